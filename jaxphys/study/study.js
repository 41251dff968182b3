"use strict";

const study = JSON.parse(document.getElementById("study").textContent);
const place = document.getElementById("place");

function element(tag, given, ...inside) {
  const made = Object.assign(document.createElement(tag), given);
  made.append(...inside);
  return made;
}

// ---- what is kept in this browser, so that a closed page goes on where it was -------------------

function keyOf(seat) {
  return study.format + "/" + study.study + "/" + seat;
}

function kept(seat) {
  try {
    const answers = JSON.parse(localStorage.getItem(keyOf(seat)));
    if (Array.isArray(answers) && answers.length <= study.seats[seat].length) return answers;
  } catch (error) {
    // A browser that keeps nothing for pages from the disk begins anew.
  }
  return [];
}

function keep(seat, answers) {
  try {
    localStorage.setItem(keyOf(seat), JSON.stringify(answers));
    return true;
  } catch (error) {
    return false;
  }
}

// ---- the seat ------------------------------------------------------------------------------------

function chooseSeat() {
  const number = element("input", { type: "number", min: 1, max: study.seats.length, id: "seat" });
  const told = element("p", { className: "small" });
  const begin = element("button", { type: "button", id: "begin", textContent: "I agree, begin" });
  begin.onclick = () => {
    const seat = Number(number.value) - 1;
    if (!Number.isInteger(seat) || !study.seats[seat]) {
      told.textContent = "Type in the number that you were given, 1 to " + study.seats.length + ".";
      return;
    }
    ask(seat, kept(seat));
  };
  place.replaceChildren(
    element("p", {}, element("label", { htmlFor: "seat", textContent: "Your number: " }), number,
      " ", begin), told);
  number.focus();
}

// ---- one question a page --------------------------------------------------------------------------

// A clip that must be played to its end; going ahead of what was seen is taken back.
function clipOf(name, whenPlayed, whenBroken) {
  const video = element("video", { src: "clips/" + name, controls: true, muted: true,
    playsInline: true, preload: "auto" });
  video.disablePictureInPicture = true;
  const state = { video, plays: 0 };
  let furthest = 0;
  video.ontimeupdate = () => {
    if (!video.seeking) furthest = Math.max(furthest, video.currentTime);
  };
  video.onseeking = () => {
    if (!state.plays && video.currentTime > furthest + 0.3) video.currentTime = furthest;
  };
  video.onended = () => {
    state.plays += 1;
    whenPlayed();
  };
  video.onratechange = () => {
    if (video.playbackRate !== 1) video.playbackRate = 1;
  };
  video.onerror = whenBroken;
  return state;
}

function choices(question) {
  if (question.kind === "rating") {
    return [1, 2, 3, 4, 5].map((value) => [value,
      value === 1 ? "1 " + question.low : value === 5 ? "5 " + question.high : String(value)]);
  }
  return [["left", "the left one"], ["same", "no difference"], ["right", "the right one"]];
}

function ask(seat, answers) {
  const pages = study.seats[seat];
  if (answers.length === pages.length) return finish(seat, answers);
  const page = pages[answers.length], question = study.questions[page.question];
  const begun = performance.now();
  let broken = false;
  const next = element("button", { type: "button", id: "next", textContent: "Next",
    disabled: true });
  const told = element("p", { className: "small", id: "told",
    textContent: "Play " + (page.clips.length > 1 ? "both clips" : "the clip") + " to the end." });
  const group = element("fieldset", { disabled: true },
    ...choices(question).map(([value, text]) => element("label", {},
      element("input", { type: "radio", name: "answer", value: String(value) }), text)));
  const chosen = () => group.querySelector("input:checked");
  const look = () => {
    const played = broken || clips.every((clip) => clip.plays > 0);
    group.disabled = !played || broken;
    if (played) told.textContent = broken ? "A clip does not play; go on." : "";
    next.disabled = !played || !(broken || chosen());
  };
  const clips = page.clips.map((name) => clipOf(name, look, () => {
    broken = true;
    look();
  }));
  group.onchange = look;
  next.onclick = () => {
    const value = broken ? null : chosen().value;
    answers.push({
      page: answers.length,
      answer: value !== null && question.kind === "rating" ? Number(value) : value,
      plays: clips.map((clip) => clip.plays),
      seconds: Math.round((performance.now() - begun) / 100) / 10,
    });
    keep(seat, answers);
    ask(seat, answers);
  };
  place.replaceChildren(
    element("p", { className: "small",
      textContent: "Page " + (answers.length + 1) + " of " + pages.length }),
    element("p", { textContent: page.prompt }),
    element("div", { className: clips.length > 1 ? "beside" : "" }, ...clips.map((clip) => clip.video)),
    element("p", { className: "question", textContent: question.text }),
    element("p", { textContent: page.note || "" }),
    group, told, next);
}

// ---- the end ---------------------------------------------------------------------------------------

function finish(seat, answers) {
  const result = JSON.stringify({ format: study.format, version: study.version,
    study: study.study, seat, finished: true, answers }, null, 1);
  const link = element("a", { id: "save", textContent: "Save the answers",
    download: "answers-" + (seat + 1) + ".json",
    href: URL.createObjectURL(new Blob([result], { type: "application/json" })) });
  place.replaceChildren(
    element("p", { textContent: "Thank you. Save your answers and hand in the file." }),
    element("p", {}, link),
    element("p", { className: "small", textContent: "Or copy this text:" }),
    element("textarea", { id: "result", readOnly: true, value: result }));
}

chooseSeat();
