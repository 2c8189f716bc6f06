// Liveness of the picture, and its mark when it is too old.
//
// The picture is dead unless proven live: by a beat of the server that confirms it for this page and
// echoes a probe of it. The time since that probe was sent, and the age in the beat, bound the age
// of the picture. Whatever becomes of viewer, server or network, nothing has to arrive for the
// picture to be marked, and what arrives late does not count.

import { PictureAge } from "./picture_age.js";

/** Greatest age of a live picture, milliseconds: a second, less a tenth for the browser to paint the
 *  mark. */
const MAX_AGE = 900;
/** Time that a marked picture must be live before it is unmarked, milliseconds: one that is late
 *  again and again does not flash. */
const MIN_LIVE = 400;
/** Period of probes to the server, milliseconds. */
export const PROBE_PERIOD = 200;
/** Time after the last beat from which the server is silent, milliseconds; sooner where the picture is
 *  too old. */
const MAX_SILENCE = 1000;
const QUIET = 2.5 * PROBE_PERIOD;
/** Period of updates beside the instant at which the picture becomes too old, milliseconds. */
const UPDATE_PERIOD = 100;

const WORDS = {
  starting: "The viewer starts",
  lost: "Viewer lost, restarting",
  behind: "This page does not keep up",
  late: "The picture comes too late",
  silent: "The server is silent",
  away: "No connection to the server",
};

const AWAY = { condition: "away", at: -Infinity, views: 0 };
const element = (id) => document.getElementById(id);

export class Liveness {
  isLive = false;
  wasEverLive = false;
  /** Reason of the loss of viewer or connection, for people. */
  #why = "";
  #beat = AWAY;
  #pictureAge = new PictureAge();
  /** Instant since which the picture has been live without a pause; null where it is not. */
  #liveSince = null;
  /** Last instant at which the picture was known to be true. */
  #trueAt = null;
  #expiryTimer = 0;
  #seesPicture;
  #changed;

  /** `seesPicture(views)` tells whether this page shows a picture to somebody, of the view that the
   *  server counts as `views`; `changed(condition)` is called when liveness changes. */
  constructor(seesPicture, changed) {
    this.#seesPicture = seesPicture;
    this.#changed = changed;
    setInterval(() => this.update(), UPDATE_PERIOD);
  }

  /** Records a probe that is sent now; returns its number. */
  probe() {
    return this.#pictureAge.probe();
  }

  /** Takes a beat of the server. */
  takeBeat([condition, age, views, probed]) {
    this.#beat = { condition, at: performance.now(), views };
    this.#pictureAge.take(probed, age);
    this.update();
  }

  /** Forgets all proof: the connection is lost. */
  disconnected(why) {
    this.#beat = AWAY;
    this.#pictureAge.forget();
    this.explain(why);
  }

  /** Sets the reason of a loss, and updates the mark. */
  explain(why) {
    this.#why = why;
    this.update();
  }

  /** Updates the liveness of the picture, and its mark. */
  update() {
    const now = performance.now();
    const [age, condition] = [this.#pictureAge.age(), this.condition()];
    clearTimeout(this.#expiryTimer);
    if (condition === "live") {
      this.#trueAt = now - age;
      this.#expiryTimer = setTimeout(() => this.update(), MAX_AGE - age + 1);
    }
    this.#liveSince = condition === "live" ? this.#liveSince ?? now : null;
    const since = this.#liveSince;
    const passes = since !== null && (this.isLive || !this.wasEverLive || now - since >= MIN_LIVE);
    if (passes !== this.isLive) this.#switch(passes, condition);
    if (this.isLive) return;
    if (condition !== "live") element("what").textContent = WORDS[condition];
    element("age").textContent = this.#trueAt === null ? "" : `Picture ${formatAge(now - this.#trueAt)} old`;
    element("why").textContent = condition === "lost" || condition === "away" ? this.#why : "";
  }

  /** Returns `live`, or the reason for which the picture is not. */
  condition() {
    const [now, beat] = [performance.now(), this.#beat];
    if (beat.condition === "away") return "away";
    if (now - beat.at > MAX_SILENCE) return "silent";
    if (beat.condition !== "live") return beat.condition;
    if (!this.#seesPicture(beat.views)) return "behind";
    if (this.#pictureAge.age() <= MAX_AGE) return "live";
    return now - beat.at > QUIET ? "silent" : "late";
  }

  #switch(isLive, condition) {
    this.isLive = isLive;
    element("view").classList.toggle("dead", !isLive);
    this.#changed(condition);
    this.wasEverLive ||= isLive;
  }
}

function formatAge(millis) {
  const seconds = millis / 1000;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  return seconds < 120 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`;
}
