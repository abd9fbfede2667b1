/* Chooses the level of x86-64 whose code runs.  A program for any x86-64
 * contains the triangulator's code once for each level of the architecture
 * (levels.mk).  Callers know nothing of levels: each function that they call is
 * a jump through the table of the chosen level (stubs).  The results are the
 * same bytes on all levels.
 *
 * Before main and before any thread, a constructor chooses the highest level
 * that the processor and the operating system support.  A program may force
 * another level at its start, and never later:
 *
 *     const char *what = processor_force(getenv(PROCESSOR_VARIABLE));
 *     if (what != NULL)
 *         refuse(what, processor_allowed());
 *
 * The x86-64 psABI defines the levels.  Programs for other architectures, and
 * programs that were built with ARCH=, have one level. */
#ifndef BOARDS_PROCESSOR_PROCESSOR_H
#define BOARDS_PROCESSOR_PROCESSOR_H

#define PROCESSOR_VARIABLE "INCODE_PROCESSOR"

/* Makes the code of a level run, by the level's name.  NULL and "" change
 * nothing.  Returns NULL, or the reason of a refusal, a static text; then
 * nothing has changed. */
const char *processor_force(const char *name);

/* The levels that can be forced here, for a message: a static text. */
const char *processor_allowed(void);

/* "INCODE_PROCESSOR=LEVEL" of this program's environment, for the environment
 * of another program; NULL if the variable is not set. */
char *processor_variable(void);

/* The name of the level whose code runs; "native" if there is only one. */
const char *processor_level(void);

#endif
