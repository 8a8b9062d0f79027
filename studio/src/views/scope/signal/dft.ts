// SPDX-License-Identifier: Apache-2.0
// Discrete Fourier transforms of any length.
import FFT from "fft.js";

/**
 * Returns the discrete Fourier transform of real values at the frequencies 0 … N/2, as interleaved real and imaginary parts. No zero
 * padding is applied: frequency k has exactly k cycles in N values.
 */
export function dft(values: Float64Array): ArrayLike<number> {
  const count = values.length;
  if (count < 2) return [values[0] ?? 0, 0];
  if (Number.isInteger(Math.log2(count))) {
    const fft = new FFT(count);
    const out = fft.createComplexArray();
    fft.realTransform(out, values);
    return out;
  }
  return chirped(values);
}

/**
 * Computes the transform with Bluestein's algorithm (1970), as a convolution with a chirp; the length of the convolution can be chosen
 * freely.
 */
function chirped(values: Float64Array): Float64Array {
  const count = values.length;
  const size = 2 ** Math.ceil(Math.log2(2 * count - 1));
  const fft = new FFT(size);
  const [from, chirp] = [new Float64Array(2 * size), new Float64Array(2 * size)];
  const turns = Float64Array.from(values, (_, n) => (Math.PI * ((n * n) % (2 * count))) / count);
  for (let n = 0; n < count; n += 1) {
    const [cos, sin] = [Math.cos(turns[n] as number), Math.sin(turns[n] as number)];
    from[2 * n] = (values[n] as number) * cos;
    from[2 * n + 1] = -(values[n] as number) * sin;
    for (const at of n === 0 ? [0] : [n, size - n]) {
      chirp[2 * at] = cos;
      chirp[2 * at + 1] = sin;
    }
  }
  const [one, other] = [fft.createComplexArray(), fft.createComplexArray()];
  fft.transform(one, from);
  fft.transform(other, chirp);
  for (let k = 0; k < size; k += 1) {
    const [a, b, c, d] = [one[2 * k], one[2 * k + 1], other[2 * k], other[2 * k + 1]] as [number, number, number, number];
    one[2 * k] = a * c - b * d;
    one[2 * k + 1] = a * d + b * c;
  }
  fft.inverseTransform(other, one);
  const bins = Math.floor(count / 2) + 1;
  const made = new Float64Array(2 * bins);
  for (let k = 0; k < bins; k += 1) {
    const [cos, sin] = [Math.cos(turns[k] as number), Math.sin(turns[k] as number)];
    const [re, im] = [other[2 * k], other[2 * k + 1]] as [number, number];
    made[2 * k] = re * cos + im * sin;
    made[2 * k + 1] = im * cos - re * sin;
  }
  return made;
}
