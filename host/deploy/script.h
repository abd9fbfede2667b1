/* What `incode deploy` runs on a board, in the shell that is there: it looks at
 * what the board is and has, waits on standard input for what is to be
 * replaced, replaces it, and starts the node.
 *
 * It prints lines that begin with HOST_SCRIPT_MARK, as a board's own profile
 * may print others: "fact NAME VALUE" of each of enum host_fact, "ready", "step
 * WHAT", "note WHAT; WHAT NEXT", "failed WHAT; WHAT NEXT", "done STATE".  After
 * "ready" it reads, where its order is deploy:
 *
 * - a line: "keep", or the key's 64 digits; "leave": nothing follows
 * - a line: "keep", or the number of lines that follow: the unit, or the lines
 *   that start the node where no systemd runs
 * - a line: "keep", or the SHA-256 of all bytes to the end: the program */
#ifndef HOST_SCRIPT_H
#define HOST_SCRIPT_H

#define HOST_SCRIPT_MARK "incode-deploy "

enum host_fact {
    HOST_FACT_MACHINE, /* as uname -m says */
    HOST_FACT_MANAGER, /* "system", "user": of systemd; "none" */
    HOST_FACT_USER,
    HOST_FACT_FOLDER,  /* the node's own, from the root */
    HOST_FACT_FILE,    /* of its unit, or what starts it */
    HOST_FACT_PROGRAM, /* SHA-256; "-": there is none */
    HOST_FACT_KEY,     /* its digits' */
    HOST_FACT_UNIT,
    HOST_FACT_STATE, /* "running", "stopped", "failed" */
    HOST_FACT_SINCE, /* when, in its own words, or "-" */
    HOST_FACTS
};

const char *host_fact_name(enum host_fact fact);

/* The command for a board, one word after another quoted; order: "look",
 * "deploy" or "remove"; folder: "" for the usual one.  To be freed; NULL: no
 * memory. */
char *host_script_command(const char *order, unsigned node, const char *folder);

#endif
