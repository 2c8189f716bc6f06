// The program around this page: an HMI that has it in a frame. `README.md` tells what is said.

export class Program {
  #origins;

  /** `origins` may speak to this page, parted by spaces; `obey` does what they ask. */
  constructor(origins, obey) {
    // What is served beside the page may, too.
    this.#origins = [location.origin, ...origins.split(" ").filter(Boolean)];
    if (window.parent === window) return;
    addEventListener("message", ({ source, origin, data }) => {
      const isKnown = source === window.parent && this.#origins.includes(origin);
      if (isKnown && typeof data?.busbar === "string") obey(data);
    });
  }

  /** Tells the program around this page something: it hears of it if its origin is known. */
  tell(message) {
    if (window.parent === window) return;
    const around = location.ancestorOrigins?.[0];
    const origins = around ? this.#origins.filter((origin) => origin === around) : this.#origins;
    origins.forEach((origin) => window.parent.postMessage(message, origin));
  }
}
