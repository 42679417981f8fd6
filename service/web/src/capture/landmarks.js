// Landmarks of the body as the page lists them: groups, titles, and what a body needs at least.

const GROUPS = {
  Pelvis: ["asis", "psis", "iliac_crest", "sacrum", "hip", "pelvis"],
  "Left leg": [],
  "Right leg": [],
  Trunk: ["c7", "t10", "clavicle", "xiphoid", "sternum", "neck"],
  Arms: ["acromion", "shoulder", "elbow", "elbow_lateral", "elbow_medial", "wrist", "wrist_radial", "wrist_ulnar", "hand"],
  Head: ["head", "head_front", "head_back"],
};
const LEGS = { left: "Left leg", right: "Right leg" };
const CAPITALS = new Set(["asis", "psis", "c7", "t10"]);

/** What parts of a body need: for each alternative, the landmarks that are enough. */
const PELVIS = [
  ["left_hip", "right_hip"],
  ["left_asis", "right_asis", "sacrum"],
  ["left_asis", "right_asis", "left_psis", "right_psis"],
];
const JOINTS = ["knee", "ankle"];

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
  [["left_psis"], ["right_psis"]],
  [["sacrum"], ["t10", "c7"]],
]);

/** Which side a landmark is on: "left", "right" or "middle". */
export const sideOf = (landmark) => /^(left|right)_/.exec(landmark)?.[1] ?? "middle";

/** The group of a landmark. */
export function groupOf(landmark) {
  const bare = landmark.replace(/^(left|right)_/, "");
  return Object.keys(GROUPS).find((group) => GROUPS[group].includes(bare)) ?? LEGS[sideOf(landmark)] ?? "Trunk";
}

/** Landmarks by group, each in the given order. */
export function grouped(landmarks) {
  const groups = Object.fromEntries(Object.keys(GROUPS).map((group) => [group, []]));
  for (const landmark of landmarks) groups[groupOf(landmark)].push(landmark);
  return groups;
}

/** A landmark in words; `short` leaves out the side that its group has. */
export function titleOf(landmark, short = false) {
  const bare = short && groupOf(landmark).endsWith("leg") ? landmark.replace(/^(left|right)_/, "") : landmark;
  const words = bare.split("_").map((word) => (CAPITALS.has(word) ? word.toUpperCase() : word));
  const text = words.join(" ").replace(/(knee|ankle|elbow) (lateral|medial)/, "$1, $2").replace(/(wrist) (radial|ulnar)/, "$1, $2");
  return text[0].toUpperCase() + text.slice(1);
}

/** A landmark in a sentence. */
export const wordsOf = (landmark) => titleOf(landmark).replace(/^[A-Z](?=[a-z])/, (letter) => letter.toLowerCase());

/** What is still needed of a pelvis and a leg, in words; `has(landmark)` tells what there is. */
export function needed(has) {
  const lacking = [];
  if (!PELVIS.some((enough) => enough.every(has))) {
    lacking.push("of the pelvis both ASIS and the sacrum or both PSIS, or both hips");
  }
  const legs = ["left", "right"].map((side) => JOINTS.filter((joint) => !has(`${side}_${joint}`) && !has(`${side}_${joint}_lateral`)));
  if (legs.every((joints) => joints.length)) lacking.push("of a leg the knee and the ankle, at their joints or on their lateral sides");
  return lacking;
}
