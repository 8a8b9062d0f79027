// SPDX-License-Identifier: Apache-2.0
// What the real-time sanitizer lets pass in a process that a driver is checked in: transfers of what is O_NONBLOCK. Whether one waits
// nevertheless is seen by how often its thread gives up its processor.
__attribute__((visibility("default"))) const char *__rtsan_default_suppressions(void) {
    return "function-name-matches:^read$\n"
           "function-name-matches:^readv$\n"
           "function-name-matches:^recv$\n"
           "function-name-matches:^recvfrom$\n"
           "function-name-matches:^recvmsg$\n"
           "function-name-matches:^write$\n"
           "function-name-matches:^writev$\n"
           "function-name-matches:^send$\n"
           "function-name-matches:^sendto$\n"
           "function-name-matches:^sendmsg$\n";
}
