/* What is asked of the cases, a line, and the lines that answer it, the same
 * here and on a board:
 *   blocks FIRST LAST STEP   a digest of each of these blocks
 *   cases BLOCK              a digest of each case of a block
 *   steps BLOCK CASE         the case's operations and their results
 *   hello NUMBER             the same again: who asks is heard
 * An answer ends with the line "end".
 *
 * Memory: 8 KB of stack. */
#ifndef TESTS_ARITHMETIC_TALK_H
#define TESTS_ARITHMETIC_TALK_H

/* put is given each line without its end. */
void talk_answer(const char *asked,
                 void (*put)(void *context, const char *line), void *context);

#endif
