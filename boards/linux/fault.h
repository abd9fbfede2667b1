/* What is wrong with what a user has asked of a node on Linux. */
#ifndef BOARDS_LINUX_FAULT_H
#define BOARDS_LINUX_FAULT_H

/* Printed as "incode-node: WHERE VALUE: WHAT: reason; NEXT", those parts that
 * are there. */
struct linux_fault {
    const char *where, *value, *what, *next;
    int reason; /* errno, or 0 */
};

void fault_print(const struct linux_fault *fault);

#endif
