// SPDX-License-Identifier: Apache-2.0
// Calls the entry of the only block of each module in a bare loop, in turns; prints ns a call, one line a round.
#include "module.h"

enum { MODULES_MAX = 8, CALLS = 2000 }; // So short that hardly a round is interrupted.

int main(int count, char **words) {
    static block blocks[MODULES_MAX];
    int rounds = atoi(words[1]), modules = count - 2;
    for (int i = 0; i < modules; i++) open_block(words[i + 2], &blocks[i]);
    for (int round = 0; round <= rounds; round++) {
        for (int i = 0; i < modules; i++) {
            block *b = &blocks[i];
            Invocation invocation = {0, 0, 0};
            double begun = now_ns();
            for (int k = 0; k < CALLS; k++) {
                b->ports[0] = 1.0 + (k & 7);
                b->ports[1] = 0.5 * (k & 3);
                if (b->run(b->memory, &invocation) & 0xff) return 2;
            }
            // The first round fills caches.
            if (round) printf("%.3f ", (now_ns() - begun) / CALLS);
        }
        if (round) printf("\n");
    }
}
