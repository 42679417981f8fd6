"""One person in front of what is farther away, pixel by pixel."""

from motionenv._core.compilation import kernel


@kernel
def put_person(number, there, other, frame):
    """Put the pictures `other` of a person into pictures `there` (m,) of `frame`, wherever it is nearer.

    `other` are depth, limbs (m, height, width) and rgb; `frame` depth, limbs, rgb and people (n, height, width), which
    becomes `number`. Empty rgb are left out.
    """
    (depth, limbs, rgb), (all_depth, all_limbs, all_rgb, people) = other, frame
    for i in range(len(there)):
        at = there[i]
        for v in range(depth.shape[1]):
            for u in range(depth.shape[2]):
                if depth[i, v, u] < all_depth[at, v, u]:
                    all_depth[at, v, u], all_limbs[at, v, u], people[at, v, u] = depth[i, v, u], limbs[i, v, u], number
                    for c in range(3 if len(rgb) > 0 else 0):
                        all_rgb[at, v, u, c] = rgb[i, v, u, c]
