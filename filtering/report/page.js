"use strict";
(() => {
const LIVING = 6; // videos that keep their place; browsers allow few players at once
const data = JSON.parse(document.getElementById("data").textContent);
const list = document.getElementById("demos");
const demos = [...list.children];
const element = (id) => document.getElementById(id);
const key = "teasim " + Object.values(data.rows).map((row) => row[0]).sort().join("").slice(0, 400) + demos.length;

// Verdicts and names survive a reload, where the browser lets a page keep something.
const stored = () => {
  try { return { verdicts: {}, names: {}, ...JSON.parse(localStorage.getItem(key) || "{}") }; } catch { return { verdicts: {}, names: {} }; }
};
const kept = stored();
const keep = () => { try { localStorage.setItem(key, JSON.stringify(kept)); } catch { /* only this visit */ } };

// Videos are loaded when they are asked for, and one plays at a time.
let films = null, latest = null;
const living = [];
const address = (episode, camera) => {
  films ??= JSON.parse(element("films").textContent);
  return films[episode + "/" + camera];
};
function end(player) {
  const video = player.querySelector("video");
  if (video) { video.pause(); video.removeAttribute("src"); video.load(); video.remove(); }
  show(player.closest(".demo"));
}
function film(player) {
  const demo = player.closest(".demo"), camera = demo.dataset.camera;
  let video = player.querySelector("video");
  if (!video) {
    video = document.createElement("video");
    Object.assign(video, { controls: true, muted: true, playsInline: true });
    video.setAttribute("aria-label", player.querySelector(".poster").getAttribute("aria-label"));
    video.addEventListener("timeupdate", () => follow(player, video));
    player.prepend(video);
    living.push(player);
    if (living.length > LIVING) end(living.shift());
  }
  if (video.dataset.camera !== camera) {
    video.dataset.camera = camera;
    video.src = address(player.dataset.episode, camera);
  }
  show(demo);
  return video;
}
function play(player, start, stop) {
  const video = film(player);
  player.dataset.until = stop ?? "";
  latest = player; // a video that is still loading when another one is asked for does not start
  const go = () => { if (latest !== player) return; if (start !== undefined) video.currentTime = start; video.play().catch(() => {}); };
  if (video.readyState) go(); else video.addEventListener("loadedmetadata", go, { once: true });
}
function follow(player, video) {
  if (player.dataset.until && video.currentTime >= Number(player.dataset.until)) {
    player.dataset.until = "";
    video.pause();
  }
  if (!player.classList.contains("film")) return;
  const demo = player.closest(".demo"), timeline = demo.querySelector(".timeline"), here = demo.querySelector(".here");
  here.hidden = false;
  here.style.left = Math.min(100, 100 * video.currentTime / Number(timeline.dataset.seconds)) + "%";
}
// Shows what belongs to the camera of a demonstration; a player's pictures give way to its video.
function show(demo) {
  for (const part of demo.querySelectorAll("[data-camera]")) part.hidden = part.tagName !== "VIDEO" && part.dataset.camera !== demo.dataset.camera;
  for (const player of demo.querySelectorAll(".player")) {
    const playing = player.querySelector("video") !== null;
    for (const poster of player.querySelectorAll(".poster")) if (playing) poster.hidden = true; else if (!poster.dataset.camera) poster.hidden = false;
  }
  for (const button of demo.querySelectorAll("[data-pick]")) button.setAttribute("aria-pressed", button.dataset.pick === demo.dataset.camera);
}
document.addEventListener("play", (event) => {
  for (const video of document.querySelectorAll("video")) if (video !== event.target) video.pause();
}, true);

// Clicks, all in one place.
list.addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (!button) return;
  const demo = button.closest(".demo"), main = demo.querySelector(".film");
  if (button.dataset.says) return judge(demo, button.dataset.says);
  if (button.dataset.pick) return pick(demo, button.dataset.pick);
  if (button.dataset.start !== undefined) { if (main?.querySelector(".poster")) play(main, Number(button.dataset.start) + 0.01); return; }
  const player = button.closest(".player");
  if (!player) return;
  const { start, stop } = player.dataset;
  play(player, start && Number(start) + 0.01, stop);
  player.querySelector("video").focus({ preventScroll: true });
});
function pick(demo, camera) {
  demo.dataset.camera = camera;
  const main = demo.querySelector(".film"), video = main.querySelector("video");
  show(demo);
  for (const other of demo.querySelectorAll("[hidden] video")) other.pause();
  if (video) play(main, video.currentTime);
}
list.addEventListener("keydown", (event) => {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step || !event.target.classList.contains("segment")) return;
  const parts = [...event.target.parentElement.querySelectorAll(".segment")];
  const next = parts[parts.indexOf(event.target) + step];
  if (!next) return;
  event.preventDefault();
  event.target.tabIndex = -1;
  next.tabIndex = 0;
  next.focus();
});

// Verdicts of a person.
function judge(demo, says) {
  const index = demo.dataset.index;
  if (kept.verdicts[index] === says) delete kept.verdicts[index]; else kept.verdicts[index] = says;
  keep();
  tell(demo);
  count();
}
function tell(demo) {
  for (const button of demo.querySelectorAll("[data-says]")) button.setAttribute("aria-pressed", kept.verdicts[demo.dataset.index] === button.dataset.says);
}
function count() {
  const given = demos.filter((demo) => kept.verdicts[demo.dataset.index]);
  const overruled = given.filter((demo) => (kept.verdicts[demo.dataset.index] === "incorrect") !== demo.classList.contains("flagged"));
  element("judged").textContent = given.length ? `${given.length - overruled.length} confirmed, ${overruled.length} overruled.` : "No verdict of yours yet.";
}
function judged(row) {
  const says = kept.verdicts[row[1]];
  if (!says) return row;
  const bad = says === "incorrect", [id, index, , loss, flagged, group, reason, , task] = row;
  const told = bad === (flagged === "1") ? reason : `A person calls it ${says}.` + (reason && " The filter said: " + reason);
  return [id, index, bad ? "0.0" : "1.0", loss, bad ? "1" : "0", bad ? String(Math.max(1, group)) : "0", told, bad ? "1.0" : "0.0", task];
}
const cell = (text) => /[",\r\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
function save(name, type, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
element("save-weights").addEventListener("click", () => {
  const rows = Object.values(data.rows).sort((a, b) => a[1] - b[1]).map(judged);
  save("weights.csv", "text/csv", [data.columns, ...rows].map((row) => row.map(cell).join(",") + "\n").join(""));
});

// Names of sub-tasks: every text that shows one is written anew from what it said at first.
const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
const spoken = new Map(data.subtasks.map(([name, words]) => [words, name]));
const known = [...spoken.keys()].sort((a, b) => b.length - a.length);
const pattern = new RegExp("(?<![\\p{L}\\p{N}_])(?:" + known.map(escaped).join("|") + ")(?![\\p{L}\\p{N}_])", "gu");
const named = (text) => known.length ? text.replace(pattern, (words) => kept.names[spoken.get(words)] || words) : text;
const firstTexts = new Map();
function rename() {
  for (const part of list.querySelectorAll(".n")) {
    if (!firstTexts.has(part)) firstTexts.set(part, [part.textContent, part.title]);
    const [text, title] = firstTexts.get(part);
    part.textContent = named(text);
    if (title) part.title = named(title);
  }
  texts.clear();
  element("save-names").disabled = !Object.keys(kept.names).length;
}
const inputs = [...document.querySelectorAll("[data-step]")];
for (const input of inputs) {
  const [name] = data.subtasks[input.dataset.step];
  input.addEventListener("change", () => {
    const typed = input.value.trim();
    if (typed) kept.names[name] = typed; else delete kept.names[name];
    keep();
    rename();
  });
}
element("save-names").addEventListener("click", () => save("names.json", "application/json", JSON.stringify(kept.names, null, 2) + "\n"));

// Order, filters and search.
const texts = new Map();
function textOf(demo) {
  if (!texts.has(demo)) {
    const parts = demo.querySelectorAll("h3, .tag, .n");
    texts.set(demo, [data.rows[demo.dataset.index][0], ...[...parts].map((part) => part.textContent)].join(" ").toLowerCase());
  }
  return texts.get(demo);
}
const number = (name) => (a, b) => a.dataset[name] - b.dataset[name];
const orders = {
  weight: (a, b) => number("weight")(a, b) || number("index")(a, b),
  index: number("index"),
  group: (a, b) => number("number")(b, a) || orders.weight(a, b),
};
const byTask = number("place"); // the videos of a task stay together
element("order").addEventListener("change", (event) => list.append(...demos.sort((a, b) => byTask(a, b) || orders[event.target.value](a, b))));
function filter() {
  const words = element("search").value.trim().toLowerCase(), what = element("show").value, group = element("group")?.value, task = element("task")?.value;
  let shown = 0;
  for (const demo of demos) {
    const flagged = demo.classList.contains("flagged");
    const fits = { all: true, flagged, kept: !flagged, open: !kept.verdicts[demo.dataset.index] }[what];
    demo.hidden = !(fits && (!group || demo.dataset.group === group) && (!task || demo.dataset.place === task) && (!words || textOf(demo).includes(words)));
    shown += !demo.hidden;
    if (demo.hidden) for (const video of demo.querySelectorAll("video")) video.pause();
  }
  element("count").textContent = `${shown} of ${demos.length} shown`;
}
for (const id of ["search", "show", "group", "task"]) element(id)?.addEventListener("input", filter);
element("truth")?.addEventListener("change", (event) => element("page").classList.toggle("no-truth", !event.target.checked));
function arrive() { // a link to a video that is filtered away shows all
  const target = /^#demo-\d+$/.test(location.hash) && document.querySelector(location.hash);
  if (!target) return;
  if (target.hidden) {
    element("search").value = "";
    for (const id of ["show", "group", "task"]) if (element(id)) element(id).selectedIndex = 0;
    filter();
  }
  target.scrollIntoView();
}
addEventListener("hashchange", arrive);

function recall() {
  for (const demo of demos) tell(demo);
  for (const input of inputs) input.value = kept.names[data.subtasks[input.dataset.step][0]] || "";
  if (firstTexts.size || Object.keys(kept.names).length) rename();
  count();
}
recall();
addEventListener("storage", (event) => { // the page in another tab kept something
  if (event.key === key || event.key === null) { Object.assign(kept, stored()); recall(); }
});
filter(); // a browser may have kept what was typed before a reload
arrive();
document.documentElement.dataset.ready = Math.round(performance.now());
})();
