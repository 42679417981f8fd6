// Landmarks of the body as the page lists them: groups, titles, and what a body needs at least.

const GROUPS = {
  Pelvis: ["asis", "psis", "sacrum", "iliac_crest", "hip", "pelvis"],
  "Left leg": [],
  "Right leg": [],
  Trunk: ["c7", "t10", "clavicle", "xiphoid", "sternum", "neck"],
  Arms: ["acromion", "shoulder", "elbow", "elbow_lateral", "elbow_medial", "wrist", "wrist_radial", "wrist_ulnar", "hand"],
  Head: ["head_front", "head_back", "head_top", "head"],
};
/** Of legs, the ones that most marker sets have; the others follow. */
const LEG = [
  ...["knee_lateral", "knee_medial", "ankle_lateral", "ankle_medial", "heel", "toe", "metatarsal_1", "metatarsal_5"],
  ...["thigh", "shank", "trochanter", "fibula", "tibia", "knee", "ankle"],
];
const LEGS = { left: "Left leg", right: "Right leg" };
const CAPITALS = new Set(["asis", "psis", "c7", "t10"]);

/** From either of these the centres of the hips follow. */
const PELVIS = [
  ["left_asis", "right_asis", "sacrum"],
  ["left_asis", "right_asis", "left_psis", "right_psis"],
];

/** Lines between landmarks that show the body; each end is the first landmark that is known. */
export const BONES = ["left", "right"].flatMap((side) => {
  const of = (...names) => names.map((name) => `${side}_${name}`);
  const [hip, knee, ankle] = [of("hip", "trochanter", "asis"), of("knee_lateral", "knee"), of("ankle_lateral", "ankle")];
  const [shoulder, elbow] = [of("acromion", "shoulder"), of("elbow_lateral", "elbow")];
  return [
    [hip, knee],
    [knee, ankle],
    [ankle, of("heel")],
    [ankle, of("toe", "metatarsal_5", "metatarsal_1")],
    [of("heel"), of("toe", "metatarsal_5", "metatarsal_1")],
    [shoulder, elbow],
    [elbow, of("wrist_radial", "wrist_ulnar", "wrist")],
    [["sternum", "clavicle", "c7", "neck"], shoulder],
    [of("asis"), of("psis")],
    [of("psis"), ["sacrum"]],
  ];
}).concat([
  [["left_asis"], ["right_asis"]],
  [["left_hip"], ["right_hip"]],
  [["left_psis"], ["right_psis"]],
  [["sacrum"], ["t10", "c7"]],
]);

/** Which side a landmark is on: "left", "right" or "middle". */
export const sideOf = (landmark) => /^(left|right)_/.exec(landmark)?.[1] ?? "middle";

const bare = (landmark) => landmark.replace(/^(left|right)_/, "");

/** The group of a landmark. */
export function groupOf(landmark) {
  return Object.keys(GROUPS).find((group) => GROUPS[group].includes(bare(landmark))) ?? LEGS[sideOf(landmark)] ?? "Trunk";
}

/** Landmarks by group, the useful ones first. */
export function grouped(landmarks) {
  const groups = Object.fromEntries(Object.keys(GROUPS).map((group) => [group, []]));
  for (const landmark of landmarks) groups[groupOf(landmark)].push(landmark);
  for (const [group, members] of Object.entries(GROUPS)) {
    const order = members.length ? members : LEG;
    const rank = (landmark) => order.indexOf(bare(landmark)) + 1 || Infinity;
    groups[group].sort((a, b) => (rank(a) === rank(b) ? 0 : rank(a) - rank(b)));
  }
  return groups;
}

/** A landmark in words; `short` leaves out the side that its group has. */
export function titleOf(landmark, short = false) {
  const words = (short && groupOf(landmark).endsWith("leg") ? bare(landmark) : landmark).split("_").map((word) => (CAPITALS.has(word) ? word.toUpperCase() : word));
  const text = words.join(" ").replace(/(knee|ankle|elbow) (lateral|medial)/, "$1, $2").replace(/(wrist) (radial|ulnar)/, "$1, $2");
  return text[0].toUpperCase() + text.slice(1);
}

/** A landmark in a sentence. */
export const wordsOf = (landmark) => titleOf(landmark).replace(/^[A-Z](?=[a-z])/, (letter) => letter.toLowerCase());

/** What a motion still needs, in words: one leg with hip and knee; `has(landmark)` tells what there is. */
export function needed(has) {
  const pelvis = PELVIS.some((enough) => enough.every(has));
  const hips = ["left", "right"].filter((side) => pelvis || has(`${side}_hip`));
  const lacking = hips.length ? [] : ["both ASIS with the sacrum or both PSIS, or else a hip"];
  const knees = (hips.length ? hips : ["left", "right"]).some((side) => has(`${side}_knee_lateral`) || has(`${side}_knee`));
  return knees ? lacking : [...lacking, "a knee"];
}
