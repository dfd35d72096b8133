/** Practice and comparisons: loads a trial, leads through its steps, sends the answer, goes on. */

import { get } from "./api.js";
import { ChoiceStep } from "./choice.js";
import { openDraft, uuid } from "./draft.js";
import { FeedbackStep } from "./feedback.js";
import { HighlightStep } from "./highlight.js";
import { listen } from "./keys.js";
import { clearNotice, clearPending, showNotice, showPending } from "./notices.js";
import { Outbox } from "./outbox.js";
import { freeze, frozen, showEnd, showProgress, showSection } from "./steps.js";
import { Store } from "./store.js";

const study = document.getElementById("study");
const box = document.getElementById("shortcuts");
const store = new Store(study.dataset.participant);

/** Waits between attempts to load [s]. */
const RELOADS = [1, 2, 4, 8, 15];

const ENDS = {
  401: "You are not signed in here",
  403: "This page has expired",
  410: "You have withdrawn",
};

const outbox = new Outbox(store, {
  waiting: (problem, seconds) => showPending(unsent(), problem, seconds, () => outbox.hurry()),
  through: clearPending,
});

const highlights = document.getElementById("highlight"); // not on everybody's page
const steps = {
  choice: new ChoiceStep(document.getElementById("choice"), store, {
    watched,
    lap: () => keep({ replays: draft.replays + 1 }),
    chosen,
    move: (by) => go(trial.place + by),
    broken,
  }),
  feedback: new FeedbackStep(document.getElementById("feedback"), () => go(following)),
};
if (highlights)
  steps.highlight = new HighlightStep(highlights, store, {
    changed: (kept) => keep({ marks: kept }),
    confirmed: (marks) => answer(marks),
    left: () => {
      keep({ step: "choice" });
      enter("choice");
    },
    broken,
  });

let trial = null;
let draft = null;
let current = null; // the step that is shown
let following = null; // the place after the feedback

/** What the server does not know yet. */
function unsent() {
  const answered = outbox.items.some(({ path }) => path.endsWith("/answers"));
  return answered
    ? "Your answer is not stored yet. It is kept on this page."
    : "That you have watched both clips is not stored yet.";
}

/** Show a trial at its step; null is what comes after the comparisons. */
async function go(place, focus = true) {
  current?.close();
  current = null;
  if (place === null) return location.assign("/");
  freeze(true);
  trial = await load(`/api/trials/${place}`);
  if (!trial) return;
  draft = openDraft(store, trial);
  draft.save();
  showProgress(trial, study.dataset.title);
  enter(draft.step, focus);
}

/** Enter a step of the trial. */
function enter(name, focus = true) {
  current?.close();
  current = steps[name];
  if (name === "choice") current.open(trial, draft);
  if (name === "highlight") current.open(trial[draft.choice], draft.choice, trial, draft.marks);
  showSection(name, focus);
}

function keep(changes) {
  Object.assign(draft, changes);
  draft.save();
}

function watched() {
  const now = Date.now();
  keep({ watched: true, watched_at: now });
  tellWatched(trial, now);
}

async function tellWatched(of, time) {
  const path = `/api/trials/${of.place}/watched`;
  const { problem } = await outbox.send(uuid(), path, { client_time: time });
  if (!problem) of.watched = true;
  else if (!problem.body.elsewhere) refused(problem);
}

function chosen(choice) {
  clearNotice();
  const marks = choice === draft.choice ? draft.marks : storedMarks(choice);
  keep({ choice, marks, chosen_at: Date.now() });
  if (!trial.highlight || !["left", "right"].includes(choice)) return answer(null);
  keep({ step: "highlight" });
  enter("highlight");
}

/** The marks of the stored answer, when the same clip is preferred again. */
function storedMarks(choice) {
  const { answer: stored } = trial;
  if (stored?.choice !== choice) return null;
  const { good, bad, nothing } = stored;
  return { now: { good, bad, nothing }, past: [] };
}

/** Send the answer; `marks` are null without highlights. */
async function answer(marks) {
  if (frozen()) return; // it is on its way
  freeze(true);
  current.close();
  const { revision, choice, shown_at, watched_at, chosen_at, replays } = draft;
  const { good = null, bad = null, nothing = false } = marks ?? {};
  const body = {
    submission: uuid(),
    revision,
    choice,
    ...{ good, bad, nothing },
    ...{ shown_at, watched_at, chosen_at, replays },
    answered_at: Date.now(),
  };
  // Another tab may have watched, and its message may be lost.
  if (!trial.watched) tellWatched(trial, watched_at);
  const path = `/api/trials/${trial.place}/answers`;
  settle(await outbox.send(body.submission, path, body));
}

/** Go on after an answer was stored or refused. */
function settle({ reply, problem }) {
  if (problem) return refused(problem);
  draft.drop();
  const next = reply.stage === "practice" || reply.stage === "comparisons" ? reply.next : null;
  if (!reply.feedback) return go(next);
  following = next;
  current = steps.feedback;
  current.open(reply.feedback);
  showSection("feedback");
}

/** The server does not take it: say why, and show what it has. */
async function refused(problem) {
  current?.close();
  if (ENDS[problem.status]) return end(problem);
  draft?.drop();
  await start(false);
  const why =
    problem.status === 409
      ? "This comparison was answered in another tab or window; that answer is kept. Here it goes on."
      : `Your answer was not stored: ${problem.message}`;
  showNotice(why);
}

function end(problem) {
  current = null;
  clearPending();
  if (problem.status === 410) store.clear();
  showEnd(ENDS[problem.status], problem.message);
}

/** A reply of the server, however long it takes; null when this page has ended. */
async function load(path) {
  for (let attempt = 0; ; attempt += 1) {
    try {
      const reply = await get(path);
      clearPending();
      return reply;
    } catch (problem) {
      if (!problem.retry) {
        if (ENDS[problem.status]) end(problem);
        else location.assign("/"); // the participant is elsewhere by now
        return null;
      }
      const wait = Math.max(RELOADS[Math.min(attempt, RELOADS.length - 1)], problem.wait);
      await new Promise((resolve) => {
        showPending("This page cannot go on yet.", problem, wait, resolve);
        setTimeout(resolve, wait * 1000);
      });
    }
  }
}

function broken(player) {
  showNotice("A clip could not be loaded. Trying again.");
  setTimeout(() => {
    clearNotice();
    player.reload();
  }, 3000);
}

/** Send what is left from before, then go where the participant is. */
async function start(focus = true) {
  const results = await outbox.flush();
  const problem = results.map((result) => result.problem).find((found) => ENDS[found?.status]);
  if (problem) return end(problem);
  const state = await load("/api/state");
  if (!state) return;
  const here = state.stage === "practice" || state.stage === "comparisons";
  await go(here ? state.place : null, focus);
}

listen(box, (key, event) => !frozen() && Boolean(current?.key(key, event)));
box.checked = store.read("shortcuts") ?? true;
box.addEventListener("change", () => store.write("shortcuts", box.checked));
addEventListener("pageshow", (event) => event.persisted && location.reload());
start(false);
