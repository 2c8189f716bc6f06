// Freshness by echo: numbered probes to the server, and the age that an echo proves.
//
// A message tells nothing by its arrival: a slow line delivers old ones at a steady rate. The
// echo of a probe was written after the probe was sent, so what it says is no older than that.

/** Probes whose time is remembered; the echo of an older one proves nothing. */
const MAX_PROBES = 64;

/** Both clocks: the monotonic one may rest while the machine sleeps, the other may be set. */
const clocks = () => ({ monotonic: performance.now(), wall: Date.now() });

/** Milliseconds since an instant: by the clock that says more. */
function elapsed(since) {
  const now = clocks();
  return Math.max(now.monotonic - since.monotonic, now.wall - since.wall);
}

export class Freshness {
  #number = 0;
  /** By number: when each probe was sent, the oldest first. */
  #sent = new Map();
  /** The newest proof: when its probe was sent, and the age that the echo told. */
  #proof = null;

  /** Notes a probe that is sent now; returns its number. */
  probe() {
    this.#number += 1;
    this.#sent.set(this.#number, clocks());
    if (this.#sent.size > MAX_PROBES) this.#sent.delete(this.#sent.keys().next().value);
    return this.#number;
  }

  /** Takes an echo that tells the picture's age, milliseconds. */
  take(number, age) {
    const sent = this.#sent.get(number);
    this.#proof = sent === undefined ? null : { sent, age };
    for (const older of this.#sent.keys()) {
      if (older >= number) break;
      this.#sent.delete(older);
    }
  }

  /** The greatest age that the picture can have by the newest echo, milliseconds. */
  age() {
    return this.#proof === null ? Infinity : elapsed(this.#proof.sent) + this.#proof.age;
  }

  /** Forgets all: the connection is another one. Numbers go on. */
  forget() {
    this.#sent.clear();
    this.#proof = null;
  }
}
