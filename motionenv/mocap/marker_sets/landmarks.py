"""The landmarks of the body that a marker set or a marker map assigns to the points of a file.

A landmark is a place on the skin that can be felt (the ASIS, a malleolus), where laboratories put markers, or a joint's
centre. Joint centres carry the names of the body's nodes (`motionenv.body.NODES`).
"""

#: Landmarks that exist on both sides, and what each is.
SIDED = {
    "asis": "anterior superior iliac spine, at the front of the pelvis",
    "psis": "posterior superior iliac spine, at the back of the pelvis",
    "iliac_crest": "highest point of the iliac crest",
    "trochanter": "greater trochanter of the femur",
    "thigh": "lateral thigh or thigh wand, in the plane of hip, knee and the knee's axis",
    "knee_lateral": "lateral epicondyle of the femur",
    "knee_medial": "medial epicondyle of the femur",
    **{f"thigh_cluster_{i}": f"marker {i} of a rigid cluster on the thigh" for i in range(1, 6)},
    "fibula": "head of the fibula",
    "tibia": "tuberosity of the tibia, below the kneecap",
    "shank": "lateral shank or shank wand, in the plane of knee, ankle and the ankle's axis",
    **{f"shank_cluster_{i}": f"marker {i} of a rigid cluster on the shank" for i in range(1, 6)},
    "ankle_lateral": "lateral malleolus",
    "ankle_medial": "medial malleolus",
    "heel": "back of the calcaneus",
    "toe": "head of the second metatarsal, or the tip of the shoe",
    "metatarsal_1": "head of the first metatarsal",
    "metatarsal_5": "head of the fifth metatarsal",
    **{f"foot_cluster_{i}": f"marker {i} of a rigid cluster on the foot" for i in range(1, 6)},
    "acromion": "acromion, on the shoulder",
    "elbow_lateral": "lateral epicondyle of the humerus",
    "elbow_medial": "medial epicondyle of the humerus",
    "wrist_radial": "styloid process of the radius, on the side of the thumb",
    "wrist_ulnar": "styloid process of the ulna, on the side of the little finger",
    "hand": "head of the second or third metacarpal",
    "head_front": "temple",
    "head_back": "back of the head",
    "hip": "centre of the hip joint",
    "knee": "centre of the knee joint",
    "ankle": "centre of the ankle joint",
    "shoulder": "centre of the shoulder joint",
    "elbow": "centre of the elbow joint",
    "wrist": "centre of the wrist joint, or one marker on its back",
}

#: Landmarks on the body's midline.
MIDDLE = {
    "sacrum": "midway between the posterior superior iliac spines",
    **{f"pelvis_cluster_{i}": f"marker {i} of a rigid cluster on the pelvis" for i in range(1, 6)},
    "c7": "spinous process of the seventh cervical vertebra",
    "t10": "spinous process of the tenth thoracic vertebra",
    "clavicle": "jugular notch, where the clavicles meet the sternum",
    "xiphoid": "xiphoid process, at the lower end of the sternum",
    "head_top": "top of the head",
    "head": "centre of the head",
    "neck": "joint between trunk and head",
    "sternum": "middle of the sternum",
    "pelvis": "midway between the centres of the hips",
}

#: Every landmark, with its description.
LANDMARKS = {
    **MIDDLE,
    **{f"{side}_{name}": f"{side} {what}" for side in ("left", "right") for name, what in SIDED.items()},
}
