/* Which code of the triangulator runs.  A program for any x86-64 has it
 * compiled once for each level of that architecture (levels.mk).  Each of its
 * functions that others call is a jump through the table of the level that was
 * chosen (stubs), so that callers know nothing of levels, and the results are
 * the same bytes.
 *
 * A constructor chooses the highest level that processor and system have,
 * before main and before any thread.  A program may force another at its
 * start, and never later:
 *
 *     const char *what = processor_force(getenv(PROCESSOR_VARIABLE));
 *     if (what != NULL)
 *         refuse(what, processor_allowed());
 *
 * Levels are those of the x86-64 psABI.  Other architectures, and programs that
 * were made with ARCH=, have one level. */
#ifndef BOARDS_PROCESSOR_PROCESSOR_H
#define BOARDS_PROCESSOR_PROCESSOR_H

#define PROCESSOR_VARIABLE "INCODE_PROCESSOR"

/* Takes the code of a level, by its name; NULL or "": nothing changes.  Returns
 * NULL, or a static text of why it cannot, and nothing has changed. */
const char *processor_force(const char *name);

/* What may be forced here, for a message: a static text. */
const char *processor_allowed(void);

/* PROCESSOR_VARIABLE with its value as this program has it, for the environment
 * of another; NULL: it has none. */
char *processor_variable(void);

/* Name of the level whose code runs; "native": there is one. */
const char *processor_level(void);

#endif
