// NumPy's counter-based random numbers: Philox4x64-10 (Salmon et al. 2011).

const WORD = (1n << 64n) - 1n;
const MULTIPLIERS = [0xd2e7470ee14c6c93n, 0xca5a826395121157n];
const WEYL = [0x9e3779b97f4a7c15n, 0xbb67ae8584caa73bn];
const ROUNDS = 10;

/** The four uniform numbers in [0, 1) of one block; NumPy's generator starts at block 1. `key`: two integers. */
export function block(key, number) {
  let [k0, k1] = key.map(BigInt);
  let [a, b, c, d] = [BigInt(number), 0n, 0n, 0n];
  for (let round = 0; round < ROUNDS; round++) {
    const first = MULTIPLIERS[0] * a;
    const second = MULTIPLIERS[1] * c;
    [a, b, c, d] = [(second >> 64n) ^ b ^ k0, second & WORD, (first >> 64n) ^ d ^ k1, first & WORD];
    k0 = (k0 + WEYL[0]) & WORD;
    k1 = (k1 + WEYL[1]) & WORD;
  }
  return [a, b, c, d].map((word) => Number(word >> 11n) / 2 ** 53);
}

/** The first `count` numbers. */
export function uniforms(key, count) {
  return Array.from({ length: Math.ceil(count / 4) }, (_, i) => block(key, i + 1)).flat().slice(0, count);
}
