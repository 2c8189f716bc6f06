// The page: what is shown, and whether it may pass for live.
//
// It is dead unless proven live: by a beat of the server that says so of this page and echoes a
// probe of it. The time since that probe was sent, and the age that the beat tells, bound the age
// of the picture. Whatever becomes of viewer, server or network, nothing has to arrive for the
// picture to be marked, and what arrives late does not count.

import { Freshness } from "./freshness.js";
import { Hands } from "./hands.js";
import { Link } from "./link.js";
import { Picture } from "./picture.js";
import { Program } from "./program.js";

/** A picture that may be older is dead, milliseconds: within a second of what it shows, with
 *  a tenth for the browser to paint the mark. */
const MAX_AGE = 900;
/** A marked picture is unmarked once it was live for so long: one that is late again and again
 *  does not flash. */
const MIN_LIVE = 400;
/** How often the server is probed. */
const PROBE_PERIOD = 200;
/** So long after the last beat the server is silent; where the picture is too old, sooner. */
const MAX_SILENCE = 1000;
const QUIET = 2.5 * PROBE_PERIOD;
/** How often that is looked at, beside the instant at which the picture becomes too old. */
const LOOK_PERIOD = 100;
/** How long it is told what could not be done. */
const REFUSED_SHOWN = 6000;

const WORDS = {
  starting: "The viewer starts",
  lost: "Viewer lost, restarting",
  behind: "This page does not keep up",
  late: "The picture comes too late",
  silent: "The server is silent",
  away: "No connection to the server",
};

const element = (id) => document.getElementById(id);
const canvas = element("picture");
const picture = new Picture(canvas);
const program = new Program(document.documentElement.dataset.origins, obey);

const freshness = new Freshness();
let beat = { condition: "away", at: -Infinity, views: 0 };
let views = 0;
let steers = false;
let why = "";
/** How many stand how, as long as that is known. */
let alarms = null;
let isLive = false;
/** Since when the picture has been live without a pause; null where it is not. */
let liveSince = null;
let wasEverLive = false;
/** When the picture was last known to be true. */
let trueAt = null;
let refusedTimer = 0;
let expiryTimer = 0;

const link = new Link({ opened, closed, told, pictured });
const hands = new Hands(canvas, (message) => steers && link.say(message));

function opened() {
  why = "";
  views = 0;
  sayView();
  probe();
}

function closed(words) {
  beat = { condition: "away", at: -Infinity, views: 0 };
  freshness.forget();
  why = words;
  alarms = null;
  setSteers(false, false);
  look();
}

async function pictured(bytes, say) {
  const number = await picture.show(bytes);
  say({ shown: number });
  look();
}

function told(message) {
  if (message.beat) {
    const [condition, age, seenViews, probed] = message.beat;
    beat = { condition, at: performance.now(), views: seenViews };
    freshness.take(probed, age);
    look();
  } else if (message.steers !== undefined) {
    setSteers(message.steers, true);
  } else if (message.lost !== undefined) {
    why = message.lost;
    look();
  } else if (message.picked !== undefined) {
    program.tell({ busbar: "picked", equipment: message.picked });
  } else if (message.alarms) {
    alarms = message.alarms;
    if (isLive) tellAlarms();
  } else if (message.refused !== undefined) {
    refuse(message.refused);
  }
}

/** Says how large the page is, and whether anybody sees it. */
function sayView() {
  const size = [Math.round(canvas.clientWidth), Math.round(canvas.clientHeight)];
  // Until the server has heard this, what it says of the picture does not count.
  views += link.say({ view: { size, visible: !document.hidden } }) ? 1 : 0;
}

/** Asks how the picture is. */
function probe() {
  if (!document.hidden && link.isOpen) link.say({ probe: freshness.probe() });
}

/** Marks the picture for what it is worth now. */
function look() {
  const now = performance.now();
  const [age, condition] = [freshness.age(), conditionAt(now)];
  clearTimeout(expiryTimer);
  if (condition === "live") {
    trueAt = now - age;
    expiryTimer = setTimeout(look, MAX_AGE - age + 1);
  }
  liveSince = condition === "live" ? liveSince ?? now : null;
  const passes = liveSince !== null && (isLive || !wasEverLive || now - liveSince >= MIN_LIVE);
  if (passes !== isLive) {
    isLive = passes;
    turn(condition);
  }
  if (isLive) return;
  if (condition !== "live") element("what").textContent = WORDS[condition];
  element("age").textContent = trueAt === null ? "" : `Picture ${spoken(now - trueAt)} old`;
  element("why").textContent = condition === "lost" || condition === "away" ? why : "";
}

function conditionAt(now) {
  if (beat.condition === "away") return "away";
  if (now - beat.at > MAX_SILENCE) return "silent";
  if (beat.condition !== "live") return beat.condition;
  if (beat.views !== views || !picture.isThere || document.hidden) return "behind";
  if (freshness.age() <= MAX_AGE) return "live";
  return now - beat.at > QUIET ? "silent" : "late";
}

function turn(condition) {
  element("view").classList.toggle("dead", !isLive);
  if (!isLive) {
    program.tell({ busbar: "lost", reason: condition });
  } else {
    program.tell({ busbar: wasEverLive ? "recovered" : "ready" });
    wasEverLive = true;
    tellAlarms();
  }
}

function tellAlarms() {
  if (alarms !== null) program.tell({ busbar: "alarms", ...alarms });
}

function spoken(millis) {
  const seconds = millis / 1000;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  return seconds < 120 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`;
}

function setSteers(now, isKnown) {
  steers = now;
  if (!steers) hands.letGo();
  element("steering").hidden = steers || !isKnown;
}

function refuse(words) {
  const place = element("refused");
  place.textContent = words;
  place.hidden = false;
  clearTimeout(refusedTimer);
  refusedTimer = setTimeout(() => { place.hidden = true; }, REFUSED_SHOWN);
  program.tell({ busbar: "refused", reason: words });
}

/** Does what the program around this page asks. */
function obey(message) {
  switch (message.busbar) {
    case "focus": return link.say({ focus: String(message.equipment) });
    case "camera": return link.say({ camera: String(message.name) });
    case "theta": return link.say({ theta: message.value === null ? null : Number(message.value) });
    case "hello": return greet();
    default: return refuse(`'${message.busbar}' is nothing that this page does`);
  }
}

/** Tells a program that came later how things are. */
function greet() {
  const condition = conditionAt(performance.now());
  const reason = condition === "live" ? "late" : condition;
  program.tell(isLive ? { busbar: "ready" } : { busbar: "lost", reason });
  if (isLive) tellAlarms();
}

element("steer").addEventListener("click", () => {
  link.say("steer");
  canvas.focus();
});
document.addEventListener("visibilitychange", () => {
  sayView();
  probe();
  look();
});
let resizeTimer = 0;
new ResizeObserver(() => {
  clearTimeout(resizeTimer);
  resizeTimer = setTimeout(sayView, 150);
}).observe(canvas);
setInterval(look, LOOK_PERIOD);
setInterval(probe, PROBE_PERIOD);
link.open();
