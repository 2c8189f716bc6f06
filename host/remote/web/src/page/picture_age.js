// Age of the picture by echo: numbered probes to the server, and the age that an echo proves.
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

export class PictureAge {
  #number = 0;
  /** Instants of the probes by number, the oldest first. */
  #sent = new Map();
  /** Newest proof: the instant of its probe, and the age in the echo. */
  #proof = null;

  /** Records a probe that is sent now; returns its number. */
  probe() {
    this.#number += 1;
    this.#sent.set(this.#number, clocks());
    if (this.#sent.size > MAX_PROBES) this.#sent.delete(this.#sent.keys().next().value);
    return this.#number;
  }

  /** Takes an echo with the age of the picture, milliseconds. */
  take(number, age) {
    const sent = this.#sent.get(number);
    this.#proof = sent === undefined ? null : { sent, age };
    for (const older of this.#sent.keys()) {
      if (older >= number) break;
      this.#sent.delete(older);
    }
  }

  /** Returns the greatest age that the picture can have by the newest echo, milliseconds. */
  age() {
    return this.#proof === null ? Infinity : elapsed(this.#proof.sent) + this.#proof.age;
  }

  /** Forgets all probes, for a new connection. Numbers continue. */
  forget() {
    this.#sent.clear();
    this.#proof = null;
  }
}
