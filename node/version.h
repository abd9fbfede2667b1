/* The version of the programs: the host's and the nodes' are built together. */
#ifndef NODE_VERSION_H
#define NODE_VERSION_H

#define NODE_VERSION "0.1.0"

#endif
