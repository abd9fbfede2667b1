/* What a program of the host needs of its process, whatever started it:
 * descriptors 0 to 2 are open, so that no file or wire gets their numbers; the
 * ends of its children are reported, even if its parent ignores those of its
 * own; and signals are set as outputs need them (output.h).
 *
 * Memory: none.  Work: a few system calls.
 *
 *     host_begin("incode"); // first of all in main
 */
#ifndef HOST_BEGIN_H
#define HOST_BEGIN_H

/* Called first of all.  name: the process is listed under it, even if it was
 * started as /proc/self/exe. */
void host_begin(const char *name);

#endif
