#include "server/web/web_page.h"

namespace lucerna {

const std::string_view kWebPage = R"html(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Lucerna</title>
<link rel="stylesheet" href="/page.css">
</head>
<body>
<header><h1>Lucerna</h1><p id="connection" role="status"></p></header>
<form id="login" hidden>
<label>The coordinator asks for the token of an admin <input id="token" type="password" autocomplete="off"></label>
<button>Show</button>
</form>
<main>
<div class="side">
<section id="jobs"><h2>Jobs</h2>
<table><thead><tr><th>Job</th><th>State</th><th>Done</th><th>Left</th><th>Owner</th></tr></thead><tbody></tbody></table>
<p class="none">There are no jobs. <code>lucerna submit scene.pbrt</code> adds one.</p></section>
<section id="workers"><h2>Workers</h2>
<table><thead><tr><th>Worker</th><th>State</th><th>Holds</th><th>Done</th><th>Failed</th><th>Stalled</th><th>Lost</th>
<th>Crashed</th></tr></thead><tbody></tbody></table>
<p class="none">No worker has joined. <code>lucerna-worker --server HOST:PORT</code> adds one.</p></section>
<section><h2>Log</h2><pre id="log"></pre></section>
</div>
<section id="job" hidden><h2></h2>
<p id="line"></p><p id="error"></p><ul id="notes"></ul>
<p class="controls"><label>Exposure <input id="stops" type="range" min="-10" max="10" step="0.25" value="0"></label>
<output id="shown">automatic</output>
<button id="auto" type="button">automatic</button>
<label>Curve <select id="curve"><option value="clip">clip</option><option value="reinhard">reinhard</option>
<option value="filmic">filmic</option><option value="aces">aces</option></select></label></p>
<img id="image" alt="The image so far" hidden><p id="no-image" class="none"></p>
<details id="details" open><summary>Report of this moment</summary><iframe id="report" title="Report" sandbox=""></iframe></details>
</section>
</main>
<script src="/page.js"></script>
</body>
</html>
)html";

const std::string_view kWebScript = R"js("use strict";
// Texts from jobs and workers become text nodes, never markup.
const byId = id => document.getElementById(id);
let chosen = location.hash.slice(1);
let stops = "auto";
let shownImage = "", imageUrl = "", shownReport = "";

async function get(path) {
  const token = sessionStorage.getItem("token");
  const answer = await fetch(path, token ? {headers: {Authorization: "Bearer " + token}} : {});
  if (answer.status === 401 || answer.status === 403) byId("login").hidden = false;
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer;
}

function cell(row, text, kind) {
  const made = row.insertCell();
  made.textContent = text;
  if (kind) made.className = kind;
  return made;
}

function showJobs(jobs) {
  const body = byId("jobs").querySelector("tbody");
  body.replaceChildren();
  for (const job of jobs) {
    const row = body.insertRow();
    row.className = job.id === chosen ? "chosen" : "";
    const link = document.createElement("a");
    link.href = "#" + job.id;
    link.textContent = job.name;
    cell(row, "").append(link);
    cell(row, job.condition ? job.condition : job.state.toLowerCase() +
         (job.no_workers ? ", no workers" : ""));
    cell(row, job.share_done === undefined ? "" : Math.floor(100 * job.share_done) + " %", "number");
    cell(row, job.time_left || "", "number");
    cell(row, job.owner);
  }
  byId("jobs").querySelector(".none").hidden = jobs.length > 0;
}

function showWorkers(workers) {
  const body = byId("workers").querySelector("tbody");
  body.replaceChildren();
  for (const worker of workers) {
    const row = body.insertRow();
    const named = cell(row, worker.name);
    named.title = worker.id;
    cell(row, (worker.is_connected ? "" : "gone, ") + worker.state +
         (worker.reason ? ": " + worker.reason : ""));
    for (const field of ["held", "committed", "failed", "stalled", "lost", "crashed"])
      cell(row, worker[field], "number");
  }
  byId("workers").querySelector(".none").hidden = workers.length > 0;
}

async function showImage(job) {
  const path = "/jobs/" + job.id + "/image.png?stops=" + encodeURIComponent(stops) +
               "&curve=" + byId("curve").value;
  const wanted = path + " " + job.passes + " " + job.has_ended;
  if (wanted === shownImage) return;
  try {
    const image = await (await get(path)).blob();
    if (imageUrl) URL.revokeObjectURL(imageUrl);
    imageUrl = URL.createObjectURL(image);
    byId("image").src = imageUrl;
    byId("image").hidden = false;
    byId("no-image").hidden = true;
    shownImage = wanted;
  } catch (error) {
    byId("image").hidden = true;
    byId("no-image").hidden = false;
    byId("no-image").textContent = "There is no image: " + error.message;
  }
}

async function showReport(job) {
  const wanted = job.id + " " + job.error + job.has_ended;
  if (!byId("details").open || wanted === shownReport) return;
  byId("report").srcdoc = await (await get("/jobs/" + job.id + "/report")).text();
  shownReport = wanted;
}

async function showJob(job) {
  byId("job").hidden = !job;
  if (!job) return;
  chosen = job.id;
  byId("job").querySelector("h2").textContent = job.name;
  byId("line").textContent = job.failure || job.line;
  byId("error").textContent = job.error;
  byId("notes").replaceChildren(...job.notes.map(note => {
    const item = document.createElement("li");
    item.textContent = note;
    return item;
  }));
  await showImage(job);
  await showReport(job);
}

let farm = {jobs: []};
let isLooking = false;
async function look() {
  if (isLooking) return;
  isLooking = true;
  try {
    farm = await (await get("/api/farm?job=" + encodeURIComponent(chosen))).json();
    byId("login").hidden = true;
    byId("connection").textContent = "";
    showWorkers(farm.workers);
    byId("log").textContent = farm.log.join("");
    await showJob(farm.job);
    showJobs(farm.jobs);
    document.body.dataset.ready = "true";
  } catch (error) {
    byId("connection").textContent = error.message || "The coordinator does not answer.";
  }
  isLooking = false;
}

function setStops(value) {
  stops = value;
  byId("shown").textContent = value === "auto" ? "automatic" : (value >= 0 ? "+" : "") + value + " stops";
  showJob(farm.job);
}
byId("stops").addEventListener("change", () => setStops(byId("stops").value));
byId("auto").addEventListener("click", () => { byId("stops").value = 0; setStops("auto"); });
byId("curve").addEventListener("change", () => showJob(farm.job));
byId("details").addEventListener("toggle", () => showJob(farm.job));
byId("login").addEventListener("submit", event => {
  event.preventDefault();
  sessionStorage.setItem("token", byId("token").value.trim());
  look();
});
window.addEventListener("hashchange", () => {
  chosen = location.hash.slice(1);
  shownImage = shownReport = "";
  look();
});
look();
setInterval(() => { if (!document.hidden) look(); }, 2000);
)js";

const std::string_view kWebStyle =
    R"css(:root{color-scheme:light dark;--paper:#fff;--card:#f6f7f9;--ink:#1b1f23;--muted:#5b636c;--rule:#dfe3e8;--here:#e3f0f8}
@media(prefers-color-scheme:dark){:root{--paper:#14171a;--card:#1c2025;--ink:#e6e9ec;--muted:#9aa3ad;--rule:#30363d;--here:#1d3444}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:15px/1.5 system-ui,sans-serif}
header{display:flex;gap:24px;align-items:baseline;padding:20px 24px 0;max-width:1400px;margin:0 auto}
h1{font-size:24px;margin:0}
h2{font-size:17px;margin:0 0 8px;overflow-wrap:anywhere}
#connection{color:#b3261e;margin:0}
#login{max-width:1400px;margin:12px auto 0;padding:0 24px}
main{display:grid;grid-template-columns:minmax(0,2fr) minmax(0,3fr);gap:24px;max-width:1400px;margin:0 auto;padding:16px 24px 40px;
  align-items:start}
@media(max-width:900px){main{grid-template-columns:minmax(0,1fr)}}
section{background:var(--card);border:1px solid var(--rule);border-radius:8px;padding:16px 18px;overflow-x:auto}
.side{display:grid;gap:24px}
table{border-collapse:collapse;width:100%;font-size:13.5px;font-variant-numeric:tabular-nums}
th,td{text-align:left;padding:4px 8px 4px 0;border-top:1px solid var(--rule)}
td:first-child{overflow-wrap:anywhere}
thead th{border-top:0;color:var(--muted);font-weight:600}
.number{text-align:right;white-space:nowrap}
tr.chosen{background:var(--here)}
a{color:inherit}
.none{color:var(--muted)}
.controls{display:flex;flex-wrap:wrap;gap:8px 16px;align-items:center}
#image{display:block;width:100%;height:auto;border-radius:6px;background:#000;image-rendering:auto}
#notes{margin:0;padding-left:20px}
#line,#error{margin:4px 0;overflow-wrap:anywhere}
iframe{width:100%;height:720px;border:1px solid var(--rule);border-radius:6px;background:var(--paper);margin-top:8px}
pre{margin:0;max-height:320px;overflow:auto;font:12px/1.45 ui-monospace,monospace;white-space:pre-wrap;overflow-wrap:anywhere}
)css";

}  // namespace lucerna
