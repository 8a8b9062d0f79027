// SPDX-License-Identifier: Apache-2.0
/** Type declarations for those parts of fft.js that are used; the package has none. */
declare module "fft.js" {
  export default class FFT {
    /** `size` is a power of two, at least 2. */
    constructor(size: number);
    createComplexArray(): number[];
    /** Fills the first half of `out`, up to and including its middle value, with interleaved real and imaginary parts. */
    realTransform(out: number[], input: ArrayLike<number>): void;
    /** Fills `out` with the transform of complex values. */
    transform(out: number[], input: ArrayLike<number>): void;
    inverseTransform(out: number[], input: ArrayLike<number>): void;
  }
}
