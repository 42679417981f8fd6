// The settings of a stimulus: names, defaults and bounds are those of motionenv/data/stimuli/specification.py.

const number = (name, label, home, [min, max], step, unit = "") => ({ name, label, home, min, max, step, unit });
const flag = (name, label) => ({ name, label, home: false });

/** Settings in groups. `home` is the default; what has `bounds` is a number, and null where `none` says what that means. */
export const GROUPS = {
  "View and time": [
    number("view", "View (0 side, 90 front)", 0, [-360, 360], 5, "°"),
    number("turntable", "Turntable", 0, [-720, 720], 5, "°/s"),
    number("roll", "Roll", 0, [-360, 360], 5, "°"),
    number("across", "Walks across (0 in place)", 0, [0, 100], 0.5, "m"),
    number("rate", "Playback rate (−1 backwards)", 1, [-10, 10], 0.1, "×"),
    number("phase", "Phase of the first frame", 0, [-1000, 1000], 0.05, "cycles"),
    flag("inverted", "Upside down"),
  ],
  "Dots": [
    number("dots", "Dots at a time", 15, [1, 15], 1),
    { ...number("lifetime", "Lifetime (empty: unlimited)", null, [0.01, 60], 0.05, "s"), none: true },
    number("mask", "Dots of a mask", 0, [0, 1000], 5),
    number("mask_size", "Size of the mask", 1.4, [0.1, 10], 0.1, "bodies"),
    flag("scrambled", "Scrambled places"),
    flag("desynchronised", "Scrambled phases"),
    number("seed", "Seed", 0, [0, 2 ** 32 - 1], 1),
  ],
  "Looks": [
    number("dot_size", "Dot size", 3.4, [0.1, 50], 0.1, "% of body"),
    flag("lines", "Lines"),
    number("line_width", "Line width", 0.56, [0.01, 50], 0.01, "% of body"),
    number("background", "Background (0 black, 1 white)", 0, [0, 1], 0.05),
    number("contrast", "Contrast (negative: darker)", 1, [-1, 1], 0.05),
  ],
  "Film": [
    number("seconds", "Duration", 2, [0.1, 60], 0.5, "s"),
    number("fps", "Frames per second", 60, [1, 240], 1),
    number("width", "Width", 480, [16, 4096], 16, "pixels"),
    number("height", "Height", 480, [16, 4096], 16, "pixels"),
    number("size", "Body in the picture's height", 0.7, [0.05, 5], 0.05),
    { name: "format", label: "Files", home: "mp4", choices: { mp4: "Films (MP4)", png: "Frames (PNG)" } },
  ],
};

export const SETTINGS = Object.values(GROUPS).flat();
const WHOLE = ["dots", "mask", "seed", "width", "height"];
const OF_SET = GROUPS.Film.map(({ name }) => name);

/** The defaults. */
export const plain = () => Object.fromEntries(SETTINGS.map(({ name, home }) => [name, home]));

/** A setting's value from text: within its bounds, or the default where it makes no sense. */
export function parsed({ name, home, min, max, choices }, text) {
  if (choices) return text in choices ? text : home;
  if (home === false) return text === "1";
  const value = Number.parseFloat(text);
  if (!Number.isFinite(value)) return home;
  const within = Math.min(max, Math.max(min, value));
  return WHOLE.includes(name) ? Math.round(within) : within;
}

/** Why there is no such stimulus, for the user, and the names of the settings that it is about; null if there is one. */
export function problem({ dots, lifetime, background, contrast, seconds, fps }) {
  if (lifetime !== null && dots === 15) return { words: "A lifetime needs fewer dots at a time than 15, as otherwise none is free to appear: set 14 or fewer.", about: ["dots", "lifetime"] };
  const grey = greyOf({ background, contrast });
  if (Math.round(255 * grey) === Math.round(255 * background)) return { words: "The dots are as grey as the background: choose another contrast.", about: ["contrast", "background"] };
  if (Math.round(seconds * fps) <= 7200) return null;
  return { words: "A stimulus has 7200 frames at most: choose a shorter duration or fewer frames per second.", about: ["seconds", "fps"] };
}

/** Grey level of the dots, from 0 to 1. */
export const greyOf = ({ background, contrast }) => background + Math.abs(contrast) * ((contrast > 0 ? 1 : 0) - background);

const FACING = { 0: "side", 45: "oblique", 90: "front", 180: "side", 270: "back", "-90": "back" };

/** What a display is like, in a few words. */
export function shownIn({ view, inverted, scrambled, desynchronised, mask, lifetime, rate }) {
  const told = { masked: mask > 0, "limited-lifetime": lifetime !== null, inverted, scrambled: scrambled || desynchronised, backwards: rate < 0 };
  return [FACING[view] ?? `${view}-degrees`, ...Object.keys(told).filter((word) => told[word])].join("-");
}

/** What a request calls the display: all settings that aren't of the whole set. */
export const displayOf = (stimulus) => Object.fromEntries(Object.entries(stimulus).filter(([name]) => !OF_SET.includes(name)));

/** The request for each of `people` in each of `displays`. */
export function setOf(stimulus, people, displays) {
  return { people, displays, ...Object.fromEntries(OF_SET.map((name) => [name, stimulus[name]])) };
}
