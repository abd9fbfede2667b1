/* What a program of the host needs of its process, whatever started it:
 * descriptors 0 to 2 that are open, so that no file or wire takes their place;
 * the ends of children, also where the parent ignores its own; and signals as
 * outputs want them (output.h).
 *
 * Memory: none.  Work: a few system calls.
 *
 *     host_begin("incode"); // first of all in main
 */
#ifndef HOST_BEGIN_H
#define HOST_BEGIN_H

/* First of all.  name: the process is listed by it, also where it was started
 * as /proc/self/exe. */
void host_begin(const char *name);

#endif
