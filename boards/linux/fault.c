#include "fault.h"

#include <stddef.h>
#include <string.h>
#include <unistd.h>

static void say(const char *before, const char *text)
{
    if (text != NULL) {
        (void)!write(STDERR_FILENO, before, strlen(before));
        (void)!write(STDERR_FILENO, text, strlen(text));
    }
}

void fault_print(const struct linux_fault *fault)
{
    say("incode-node: ", fault->where);
    say(" ", fault->value);
    say(": ", fault->what);
    say(": ", fault->reason == 0 ? NULL : strerror(fault->reason));
    say("; ", fault->next);
    say("\n", "");
}
