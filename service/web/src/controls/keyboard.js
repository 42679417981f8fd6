// Keyboard shortcuts: of the page while no field has the focus, and of the stage while it has.

const TURN = 6; // degrees a press
const ZOOM = 1.08;
const FIGURES = { 1: "body", 2: "stick", 3: "points" };

/** Install the shortcuts. */
export function keys(app) {
  addEventListener("keydown", (event) => {
    const { target, key } = event;
    if (event.ctrlKey || event.metaKey) turnBack(app, event);
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const action = target.id === "view" ? (onStage(app, key) ?? onPage(app, key)) : onPage(app, key);
    if (!action || (target !== document.body && needs(target, key))) return;
    event.preventDefault();
    action();
  });
}

/** Ctrl+Z and Ctrl+Y, or Ctrl+Shift+Z, where no text is being written. */
function turnBack(app, event) {
  const key = event.key.toLowerCase();
  if ((key !== "z" && key !== "y") || event.target.matches("input[type=number], textarea")) return;
  event.preventDefault();
  app.turnBack(key === "z" && !event.shiftKey);
}

/** Whether the focused element uses a key itself. */
function needs(target, key) {
  if (target.matches("input[type=number], textarea, select")) return true;
  return key === " " && target.matches("button, input:not([type=range]), summary, a");
}

function onPage(app, key) {
  const actions = {
    " ": () => app.pause(),
    n: () => app.draw(),
    r: () => app.reset(),
    c: () => app.compare(),
  };
  if (FIGURES[key]) return () => app.look("figure", FIGURES[key]);
  return actions[key];
}

function onStage(app, key) {
  const [around, up, away] = app.stage.view;
  const moves = {
    ArrowLeft: { around: around - TURN },
    ArrowRight: { around: around + TURN },
    ArrowUp: { up: up + TURN },
    ArrowDown: { up: up - TURN },
    "+": { away: away / ZOOM },
    "=": { away: away / ZOOM },
    "-": { away: away * ZOOM },
  };
  return moves[key] && (() => app.view(moves[key]));
}
