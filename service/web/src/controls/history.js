// Undo and redo of what was done to people.

const TOGETHER = 600; // [ms] within which changes are one step, as while a slider is dragged
const MOST = 200;

const seen = ({ model, people, chosen }) => structuredClone({ model, people, chosen });

/** States of people before and after the present one. */
export class History {
  constructor() {
    this.past = [];
    this.future = [];
    this.last = -Infinity;
  }

  /** Keep the present state before it is changed, unless it just was; `apart`: as a step of its own. */
  remember(state, apart = false) {
    const now = performance.now();
    if (apart || now - this.last > TOGETHER) {
      this.past = [...this.past, seen(state)].slice(-MOST);
      this.future = [];
    }
    this.last = apart ? -Infinity : now;
  }

  /** The state before the present one, or undefined. */
  back(state) {
    return this.pass(state, this.past, this.future);
  }

  /** The state that was left by `back`, or undefined. */
  forth(state) {
    return this.pass(state, this.future, this.past);
  }

  pass(state, from, to) {
    if (!from.length) return undefined;
    to.push(seen(state));
    this.last = -Infinity;
    return from.pop();
  }
}
