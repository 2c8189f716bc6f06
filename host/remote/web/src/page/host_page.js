// Messages to and from the host page: an HMI that embeds this page in a frame. `README.md` lists them.

export class HostPage {
  #origins;

  /** `origins` may speak to this page, separated by spaces; `handleRequest` takes their requests. */
  constructor(origins, handleRequest) {
    // Pages of this server may speak to it, too.
    this.#origins = [location.origin, ...origins.split(" ").filter(Boolean)];
    if (window.parent === window) return;
    addEventListener("message", ({ source, origin, data }) => {
      const isKnown = source === window.parent && this.#origins.includes(origin);
      if (isKnown && typeof data?.busbar === "string") handleRequest(data);
    });
  }

  /** Posts a message to the host page, if its origin is known. */
  post(message) {
    if (window.parent === window) return;
    const around = location.ancestorOrigins?.[0];
    const origins = around ? this.#origins.filter((origin) => origin === around) : this.#origins;
    origins.forEach((origin) => window.parent.postMessage(message, origin));
  }
}
