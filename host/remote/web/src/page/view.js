// The page: its picture, and the decision whether the picture is live.
//
// It is dead unless proven live: by a beat of the server that confirms it for this page and echoes a
// probe of it. The time since that probe was sent, and the age in the beat, bound the age
// of the picture. Whatever becomes of viewer, server or network, nothing has to arrive for the
// picture to be marked, and what arrives late does not count.

import { Freshness } from "./freshness.js";
import { InputState } from "./input.js";
import { ServerConnection } from "./connection.js";
import { Picture } from "./picture.js";
import { HostPage } from "./host_page.js";

/** Greatest age of a live picture, milliseconds: a second, less a tenth for the browser to paint the
 *  mark. */
const MAX_AGE = 900;
/** Time that a marked picture must be live before it is unmarked, milliseconds: one that is late
 *  again and again does not flash. */
const MIN_LIVE = 400;
/** Period of probes to the server, milliseconds. */
const PROBE_PERIOD = 200;
/** Time after the last beat from which the server is silent, milliseconds; sooner where the picture is
 *  too old. */
const MAX_SILENCE = 1000;
const QUIET = 2.5 * PROBE_PERIOD;
/** Period of liveness updates beside the instant at which the picture becomes too old, milliseconds. */
const UPDATE_PERIOD = 100;
/** Time for which a refusal is shown, milliseconds. */
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
const hostPage = new HostPage(document.documentElement.dataset.origins, handleRequest);

const freshness = new Freshness();
let beat = { condition: "away", at: -Infinity, views: 0 };
let views = 0;
let steers = false;
let why = "";
/** Alarm counts by state, while they are known. */
let alarms = null;
let isLive = false;
/** Instant since which the picture has been live without a pause; null where it is not. */
let liveSince = null;
let wasEverLive = false;
/** Last instant at which the picture was known to be true. */
let trueAt = null;
let refusedTimer = 0;
let expiryTimer = 0;

const connection = new ServerConnection({ opened, closed, handleMessage, handlePicture });
const input = new InputState(canvas, (message) => steers && connection.send(message));

function opened() {
  why = "";
  views = 0;
  sendView();
  probe();
}

function closed(words) {
  beat = { condition: "away", at: -Infinity, views: 0 };
  freshness.forget();
  why = words;
  alarms = null;
  setSteering(false, false);
  updateLiveness();
}

async function handlePicture(bytes, reply) {
  const number = await picture.show(bytes);
  reply({ shown: number });
  updateLiveness();
}

function handleMessage(message) {
  if (message.beat) {
    const [condition, age, seenViews, probed] = message.beat;
    beat = { condition, at: performance.now(), views: seenViews };
    freshness.take(probed, age);
    updateLiveness();
  } else if (message.steers !== undefined) {
    setSteering(message.steers, true);
  } else if (message.lost !== undefined) {
    why = message.lost;
    updateLiveness();
  } else if (message.picked !== undefined) {
    hostPage.post({ busbar: "picked", equipment: message.picked });
  } else if (message.alarms) {
    alarms = message.alarms;
    if (isLive) postAlarms();
  } else if (message.refused !== undefined) {
    refuse(message.refused);
  }
}

/** Sends the size of the page, and its visibility. */
function sendView() {
  const size = [Math.round(canvas.clientWidth), Math.round(canvas.clientHeight)];
  // Until the server has heard this, what it says of the picture does not count.
  views += connection.send({ view: { size, visible: !document.hidden } }) ? 1 : 0;
}

/** Sends a probe, whose echo proves the age of the picture. */
function probe() {
  if (!document.hidden && connection.isOpen) connection.send({ probe: freshness.probe() });
}

/** Updates the liveness of the picture, and its mark. */
function updateLiveness() {
  const now = performance.now();
  const [age, condition] = [freshness.age(), conditionAt(now)];
  clearTimeout(expiryTimer);
  if (condition === "live") {
    trueAt = now - age;
    expiryTimer = setTimeout(updateLiveness, MAX_AGE - age + 1);
  }
  liveSince = condition === "live" ? liveSince ?? now : null;
  const passes = liveSince !== null && (isLive || !wasEverLive || now - liveSince >= MIN_LIVE);
  if (passes !== isLive) {
    isLive = passes;
    switchLiveness(condition);
  }
  if (isLive) return;
  if (condition !== "live") element("what").textContent = WORDS[condition];
  element("age").textContent = trueAt === null ? "" : `Picture ${formatAge(now - trueAt)} old`;
  element("why").textContent = condition === "lost" || condition === "away" ? why : "";
}

function conditionAt(now) {
  if (beat.condition === "away") return "away";
  if (now - beat.at > MAX_SILENCE) return "silent";
  if (beat.condition !== "live") return beat.condition;
  if (beat.views !== views || !picture.hasPicture || document.hidden) return "behind";
  if (freshness.age() <= MAX_AGE) return "live";
  return now - beat.at > QUIET ? "silent" : "late";
}

function switchLiveness(condition) {
  element("view").classList.toggle("dead", !isLive);
  if (!isLive) {
    hostPage.post({ busbar: "lost", reason: condition });
  } else {
    hostPage.post({ busbar: wasEverLive ? "recovered" : "ready" });
    wasEverLive = true;
    postAlarms();
  }
}

function postAlarms() {
  if (alarms !== null) hostPage.post({ busbar: "alarms", ...alarms });
}

function formatAge(millis) {
  const seconds = millis / 1000;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  return seconds < 120 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`;
}

function setSteering(now, isKnown) {
  steers = now;
  if (!steers) input.releaseKeys();
  element("steering").hidden = steers || !isKnown;
}

function refuse(words) {
  const place = element("refused");
  place.textContent = words;
  place.hidden = false;
  clearTimeout(refusedTimer);
  refusedTimer = setTimeout(() => { place.hidden = true; }, REFUSED_SHOWN);
  hostPage.post({ busbar: "refused", reason: words });
}

/** Executes a request of the host page. */
function handleRequest(message) {
  switch (message.busbar) {
    case "focus": return connection.send({ focus: String(message.equipment) });
    case "camera": return connection.send({ camera: String(message.name) });
    case "theta": return connection.send({ theta: message.value === null ? null : Number(message.value) });
    case "hello": return postState();
    default: return refuse(`'${message.busbar}' is nothing that this page does`);
  }
}

/** Posts the present state to a host page that was loaded later. */
function postState() {
  const condition = conditionAt(performance.now());
  const reason = condition === "live" ? "late" : condition;
  hostPage.post(isLive ? { busbar: "ready" } : { busbar: "lost", reason });
  if (isLive) postAlarms();
}

element("steer").addEventListener("click", () => {
  connection.send("steer");
  canvas.focus();
});
document.addEventListener("visibilitychange", () => {
  sendView();
  probe();
  updateLiveness();
});
let resizeTimer = 0;
new ResizeObserver(() => {
  clearTimeout(resizeTimer);
  resizeTimer = setTimeout(sendView, 150);
}).observe(canvas);
setInterval(updateLiveness, UPDATE_PERIOD);
setInterval(probe, PROBE_PERIOD);
connection.open();
