// Where the sun is, seen from the walker [m].
export const SUN = [2.2, -2.4, 5];
