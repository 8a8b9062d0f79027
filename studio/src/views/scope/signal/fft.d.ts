// SPDX-License-Identifier: Apache-2.0
/** Types of the part of fft.js that is used, as it has none of its own. */
declare module "fft.js" {
  export default class FFT {
    /** `size`: a power of two, 2 at least. */
    constructor(size: number);
    createComplexArray(): number[];
    /** Fills the first half of `out`, and the value in its middle: real and imaginary part in turn. */
    realTransform(out: number[], input: ArrayLike<number>): void;
    /** Fills all of `out` from complex values. */
    transform(out: number[], input: ArrayLike<number>): void;
    inverseTransform(out: number[], input: ArrayLike<number>): void;
  }
}
