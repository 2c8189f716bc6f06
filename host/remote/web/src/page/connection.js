// WebSocket connection to the server, reopened with growing delays.

const PROTOCOL = "busbar.2";
const TOKEN_PROTOCOL = "busbar.token.";
/** Shortest and longest delay between attempts, milliseconds. */
const FIRST_DELAY = 250;
const MAX_DELAY = 5000;
/** Silence after which a connection is closed, milliseconds. */
const MAX_SILENCE = 4000;

/** Takes the token out of the address of the page; null where it has none. */
function takeToken() {
  const address = new URL(location.href);
  const token = address.searchParams.get("token");
  if (token !== null) {
    address.searchParams.delete("token");
    history.replaceState(null, "", address);
  }
  return token;
}

export class ServerConnection {
  #listener;
  #token = takeToken();
  #socket = null;
  #delay = FIRST_DELAY;
  #receivedAt = 0;

  /** `listener` has opened(), closed(reason), handleMessage(message) and handlePicture(bytes, reply),
   *  whose `reply` sends to the socket of the picture. */
  constructor(listener) {
    this.#listener = listener;
    setInterval(() => this.#closeIfSilent(), 500);
  }

  open() {
    const address = new URL("socket", location.href);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    address.search = "";
    const protocols = [PROTOCOL];
    // Frames of other sites may keep no cookie.
    if (this.#token) protocols.push(TOKEN_PROTOCOL + this.#token);
    const socket = new WebSocket(address, protocols);
    socket.binaryType = "arraybuffer";
    let wasOpen = false;
    this.#socket = socket;
    this.#receivedAt = performance.now();
    socket.onopen = () => {
      wasOpen = true;
      this.#listener.opened();
    };
    socket.onmessage = ({ data }) => {
      if (socket !== this.#socket) return;
      this.#receivedAt = performance.now();
      this.#delay = FIRST_DELAY;
      if (typeof data === "string") this.#listener.handleMessage(JSON.parse(data));
      else this.#listener.handlePicture(data, (message) => socket === this.#socket && this.send(message));
    };
    socket.onclose = ({ reason }) => {
      if (socket === this.#socket) this.#handleClose(reason, wasOpen);
    };
  }

  /** Reports whether the connection is open. */
  get isOpen() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /** Sends a message where the connection is open; returns whether it was sent. */
  send(message) {
    if (!this.isOpen) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  async #handleClose(reason, wasOpen) {
    this.#socket = null;
    this.#listener.closed(reason);
    const delay = this.#delay * (0.75 + Math.random() / 2);
    this.#delay = Math.min(this.#delay * 2, MAX_DELAY);
    setTimeout(() => this.open(), delay);
    // A socket does not tell why it was refused.
    if (!wasOpen && (await this.#isTokenRefused())) {
      this.#listener.closed("the server refuses this page's token; open its new address");
    }
  }

  async #isTokenRefused() {
    const headers = this.#token ? { Authorization: `Bearer ${this.#token}` } : {};
    try {
      return (await fetch("socket", { headers, cache: "no-store" })).status === 401;
    } catch {
      return false;
    }
  }

  #closeIfSilent() {
    const socket = this.#socket;
    if (socket === null || performance.now() - this.#receivedAt < MAX_SILENCE) return;
    // Its own end may come much later.
    socket.close();
    this.#handleClose("", true);
  }
}
