/* The version of the programs: the host's and the nodes' are built together.
 *
 * Memory, work: none. */
#ifndef NODE_VERSION_H
#define NODE_VERSION_H

#define NODE_VERSION "0.1.0"

#endif
