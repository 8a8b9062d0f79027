// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(next_code, "The next code of a scanner that was not taken yet, and whether it begins with the letter of our parts.",
    device    (double, count, read,      "how many codes have come so far"),
    device    (uint8_t[16], text, read,  "the newest one"),
    out       (uint8_t[16], code,        "the code that was taken"),
    param     (uint8_t, letter, 'A',     "what the codes of our parts begin with"),
    state_keep(double, taken, 0.0,       "how many had come when the last one was taken"),
    condition (ours,                     "a code came that begins with the letter"),
    condition (foreign,                  "a code came that begins with another one"))
{
    if (self->count < self->taken) self->taken = 0.0;   // the scanner was opened anew
    if (self->count == self->taken) return OK;
    self->taken = self->count;
    for (int i = 0; i < 16; i++) self->code[i] = self->text[i];
    if (self->code[0] == self->letter) report(ours);
    else report(foreign);
    return OK;
}
