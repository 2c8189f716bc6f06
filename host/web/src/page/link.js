// The socket to the server, opened again and again.

const PROTOCOL = "busbar.2";
const TOKEN_PROTOCOL = "busbar.token.";
/** Delays between tries, milliseconds. */
const FIRST_DELAY = 250;
const MAX_DELAY = 5000;
/** A connection that says nothing for so long is given up. */
const MAX_SILENCE = 4000;

/** The token, where the address has it: kept here, and no longer in the address. */
function takeToken() {
  const address = new URL(location.href);
  const token = address.searchParams.get("token");
  if (token !== null) {
    address.searchParams.delete("token");
    history.replaceState(null, "", address);
  }
  return token;
}

export class Link {
  #listener;
  #token = takeToken();
  #socket = null;
  #delay = FIRST_DELAY;
  #heard = 0;

  /** `listener` has opened(), closed(words), told(message) and pictured(bytes, say),
   *  whose `say` speaks to whoever sent the picture. */
  constructor(listener) {
    this.#listener = listener;
    setInterval(() => this.#giveUpIfSilent(), 500);
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
    this.#heard = performance.now();
    socket.onopen = () => {
      wasOpen = true;
      this.#listener.opened();
    };
    socket.onmessage = ({ data }) => {
      if (socket !== this.#socket) return;
      this.#heard = performance.now();
      this.#delay = FIRST_DELAY;
      if (typeof data === "string") this.#listener.told(JSON.parse(data));
      else this.#listener.pictured(data, (message) => socket === this.#socket && this.say(message));
    };
    socket.onclose = ({ reason }) => {
      if (socket === this.#socket) this.#lose(reason, wasOpen);
    };
  }

  /** Whether anybody is there. */
  get isOpen() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /** Says something, if anybody is there; whether it did. */
  say(message) {
    if (!this.isOpen) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  async #lose(reason, wasOpen) {
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

  #giveUpIfSilent() {
    const socket = this.#socket;
    if (socket === null || performance.now() - this.#heard < MAX_SILENCE) return;
    // Its own end may come much later.
    socket.close();
    this.#lose("", true);
  }
}
