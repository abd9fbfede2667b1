/* The host's end of a cube, on a machine's wires. */
#ifndef HOST_SERVICE_PARTS_H
#define HOST_SERVICE_PARTS_H

#include "machine.h"
#include "service.h"

/* window: frames; 0: a large one.  NULL: HOST_BROKEN.  The caller frees
 * *memory, in both cases. */
struct cube *host_cube_make(const struct host_machine *machine, unsigned window,
                            void **memory, struct host_error *error);

/* What the user is told of nodes and wires while a run goes on: a line each, as
 * `incode: node 3 link 1: WHAT; WHAT TO DO NEXT`, on standard error, whatever
 * else is quiet, or to whom the machine names.  Part of service.h. */

enum { HOST_NOTICE_BYTES = 2000 }; /* of a line, cut there */

void host_notice(struct host_service *service, unsigned node,
                 const char *format, ...) __attribute__((format(printf, 3, 4)));

/* The same of one of its links. */
void host_notice_of(struct host_service *service, unsigned node, unsigned link,
                    const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* The same of the host's own wire, or of no node in particular. */
void host_notice_line(struct host_service *service, const char *line);

/* What nodes report as faults, and whether to believe them.  Part of service.h.
 *
 * If a node between two others restarts, messages on their way are lost, and
 * the messages after the gap look wrong to the node that gets them.  So a fault
 * counts only once every living node has answered a ping sent after the fault
 * arrived, and no node has reported a loss.  (A loss begins a new generation,
 * in which all nodes begin anew.)  A fault that no loss can explain counts at
 * once, but for a list that nodes share and that is too small for one of them:
 * that of a node which works alone may suffice.
 *
 * A fault that counts does not end the run as long as another node is left.
 * The first time all nodes go on, each working alone.  If a node then reports
 * a fault, that node is excluded (audit.h). */

/* A generation begins: what was said before counts no more. */
void host_faults_begin(struct host_service *service);

/* NODE_FAULT: HOST_CUBE, if it counts at once; else 0. */
int host_faults_take(struct host_service *service,
                     const struct cube_message *message,
                     struct host_error *error);

/* A ping has gone to a node: what it told as the count of messages sent. */
void host_faults_pinged(struct host_service *service, unsigned node,
                        uint32_t count);

/* A node has answered the ping of that count, and has missed nothing:
 * HOST_CUBE, if a fault counts now; else 0. */
int host_faults_answered(struct host_service *service, unsigned node,
                         uint32_t count, struct host_error *error);

/* Nodes that have not come yet.  Part of service.h.
 *
 * Before the first job is given out, the host waits until all nodes are up.  A
 * node is up if it has answered, or if a neighbour's wire to it has been up: a
 * node behind a missing one may be silent and up.  After a second and a half,
 * and whenever something changes, a notice names the nearest missing node, the
 * reason, and how to start it.  Another notice says when all nodes are up.
 *
 * The run ends when no further node has come up for the length of the patience.
 * Time in which the host did not poll does not count.  Nor does time in which a
 * node's process on this machine waited for a processor.  So a busy machine
 * ends no run, and a program that is no node is found as soon as on a quiet
 * machine. */

/* How long nodes are waited for: as the user wants, or as long as the machine
 * needs to start them. */
uint64_t host_bring_up_patience(const struct host_service *service);

/* HOST_CUBE where none has come for so long. */
int host_bring_up_check(struct host_service *service, uint64_t now_us,
                        uint64_t elapsed_us, struct host_error *error);

/* All have come: tells who was told that they had not. */
void host_bring_up_done(struct host_service *service);

/* Generations of the cube's wiring: after a loss a new one begins without what
 * was given up, in which all nodes begin again with what is not committed.
 * Part of service.h. */

/* The node by which the host speaks in a wiring: as before, or the other one
 * that has a wire to the host. */
uint16_t host_generation_gateway(const struct host_service *service,
                                 const struct cube_wiring *next);

/* After a loss.  HOST_CUBE where the cube cannot go on: without its gateway,
 * or after too many losses in a row without a brick between them. */
int host_generation_renew(struct host_service *service, uint64_t now_us,
                          struct host_error *error);

/* The wiring's generation is another than service->generation. */
int host_generation_begin(struct host_service *service, uint64_t now_us,
                          struct host_error *error);

/* The results of a node's job: tetrahedra for the list, bricks committed, faces
 * spilled.  Part of service.h.
 *
 * Nothing is taken unchecked.  All vertices of a tetrahedron, or of a face,
 * must be points, and different.  The brick that owns the tetrahedron must
 * belong to the node's job, and must not be committed.  A node that sends
 * anything else is named, and loses its job (host_idle_leave); its committed
 * bricks stay.
 *
 * What a node can make the host keep is bounded.  If a job has more than 16
 * tetrahedra a point, or a node has more than 16 spilled faces a point of its
 * job, these are judged.  If some are wrong or come twice, the node is refused;
 * else the bound is doubled, as a hub or two skew lines have so many.
 *
 * Work: about 10 ns a tetrahedron. */

/* Of a job that is current; the results behind the header.  0, or an error. */
int host_results_take(struct host_service *service,
                      const struct cube_message *message,
                      struct host_error *error);

/* Of a job that is current: `count` faces, and marks of vertices of the job
 * that were reached (incode/front/job.h), into the store.  0, or an error. */
int host_results_spill(struct host_service *service, unsigned node,
                       const struct incode_face *faces, uint32_t count,
                       struct host_error *error);

/* Names the node and takes its job away.  The node is started again; if it had
 * its new start already, or the host cannot start it, it is excluded.  0, or
 * HOST_UNVERIFIED if no other node is left. */
int host_results_refuse(struct host_service *service, unsigned node,
                        const char *why, struct host_error *error);

/* What the host sends: to each node in turn what is due to it, pings, the
 * setup, jobs, credit, what the strategy has, spilled faces, pages.  Part of
 * service.h. */

/* A generation begins, all nodes are as after their start: nothing is out,
 * nothing asked for, and each has to have its setup. */
void host_sending_begin(struct host_service *service);

/* Every node has its setup: the first jobs. */
void host_sending_deal(struct host_service *service);

/* Serves the nodes in turn, while the wire takes it; returns how many messages
 * went.  The error is that of a spill's file. */
unsigned host_sending_serve(struct host_service *service,
                            struct host_error *error);

/* Whether a node has asked for pages and not got them yet. */
bool host_sending_pages_wait(const struct host_service *service);

/* `write` and `write_to_all` of struct host_work. */
bool host_sending_write(void *service, unsigned node, uint8_t type,
                        const void *data, size_t size);
bool host_sending_write_to_all(void *service, uint8_t type, const void *data,
                               size_t size);

/* What the host does with each message of a node.  Part of service.h. */

int host_handle(struct host_service *service,
                const struct cube_message *message, struct host_error *error);

/* Tells the user, once, where a run spends its time on pages: nodes whose
 * memory does not hold the points that they look at ask for the same pages
 * again and again.  It is so where what was asked for again is many times what
 * has come of it, and took a second or more.  Part of service.h.
 *
 * A page takes a node some 30 us, a tetrahedron 1 us (of points on a sphere,
 * 20); that each node has each page once counts for nothing.  Measured, pages
 * asked for again are a part of a tetrahedron of none for uniform points on
 * nodes of 4M, 1/100 on 1M; 1/16 of 200,000 points around a blunt fin on 4M,
 * 1/2 on 1M; 30 for as many on a sphere.  The bound is 1/6. */

enum {
    HOST_PAGING_AGAIN_MIN = 20000, /* pages; fewer are not worth a word */
    HOST_PAGING_TETRAHEDRA = 6     /* for each of them; more: all is well */
};

/* A page has gone to a node. */
void host_paging_sent(struct host_service *service);

/* The run is over, and what the nodes have asked for is known. */
void host_paging_end(struct host_service *service);

/* The least power of two of bytes a node that holds so many pages, where
 * `memory` holds `frames`; at most HOST_MEMORY_MAX. */
uint64_t host_paging_memory(uint64_t memory, uint64_t frames, uint64_t pages);

/* Whether all nodes are there, and have missed nothing.  Part of service.h.
 *
 * Each node is pinged in turn.  Its pong names its start and how many messages
 * it has had and sent; another start than before, or a count that does not
 * match, is a loss.  So is a node that the machine had to start again, a dead
 * link that the cube has found and that no node needs, and a node that does not
 * answer for the length of the service's patience, in the last part of which it
 * is pinged alone, in the next generation: the machine ends it, if it can start
 * it again, and it is given up otherwise.  One that answers and does nothing:
 * idle_nodes.h.  What the user is told meanwhile: suspects.h. */

/* A generation begins: who is living by the wiring, and all are pinged. */
void host_detector_begin(struct host_service *service, uint64_t now_us);

/* The run is over, for those too whose statistics have not come. */
void host_detector_end(struct host_service *service);

/* By which of its wires the host speaks now. */
unsigned host_detector_wire(const struct host_service *service);

/* The link by which a node is reached first. */
unsigned host_detector_link(const struct host_service *service, unsigned node);

/* Sends the ping that is due to a node; false: no room. */
bool host_detector_ping(struct host_service *service, uint16_t to);

/* NODE_PONG. */
int host_detector_pong(struct host_service *service,
                       const struct cube_message *message,
                       struct host_error *error);

/* HOST_CUBE, if the machine knows why a node is not heard; else 0. */
int host_detector_doubt(const struct host_service *service, unsigned node,
                        struct host_error *error);

/* Sets service->loss where a new generation is due.  HOST_CUBE where the cube
 * cannot go on. */
int host_detector_check(struct host_service *service, uint64_t now_us,
                        struct host_error *error);

/* Suspect nodes and wires: a notice when one falls silent, before the cause is
 * clear, and another when it is back.  Part of service.h.
 *
 * A node that reads nothing from its links holds up messages of other nodes, so
 * a node that the host does not hear need not be the cause.  Therefore every
 * node reports, unasked, the links on which nothing has come for a second.  A
 * node is suspect if it does not answer pings and every neighbour that is
 * itself up reports it silent.  If some neighbour still hears it, the suspect
 * is the wire, not the node.
 *
 * If there are more nodes than processors, or the machine is busy, a sound node
 * may be silent for seconds.  So a node becomes suspect only after twice the
 * longest silence of late after which that node, or a neighbour of it, answered
 * again.  A silence does not count if a node was suspect during it, or if the
 * node reports a silent neighbour after it: a node that stands still also holds
 * up messages for others. */

void host_suspects_check(struct host_service *service, uint64_t elapsed_us);

/* The node has answered; anew: it is another start than before. */
void host_suspects_heard(struct host_service *service, unsigned node,
                         bool anew);

/* Nodes that answer and do nothing.  Part of service.h.
 *
 * What a node owes - that it is ready, the results of its job, its statistics -
 * it has to work for: its pongs count the steps that it does, and whatever else
 * it sends is progress as well.  One that owes something, is owed nothing by
 * the host, and shows no progress for the length of the service's patience is
 * idle; if it waits for a page or for answers of another node, that one is, or
 * who that one waits for, unless it goes on: then nobody is.  The machine ends
 * it, if it can start it again; if it cannot, or has done so before, the node
 * is left aside for the rest of the run, which goes on without its work, but by
 * its links. */

/* The node has done something, or has something to do from now on. */
void host_idle_progress(struct host_service *service, unsigned node);

/* A node is not to be trusted with work, as `why` says: ends it for a new
 * start, or leaves it aside.  False: it had its new start already. */
bool host_idle_leave(struct host_service *service, unsigned node,
                     const char *why);

/* Wires that are missing from the start: not put in, or broken before.  Part of
 * service.h.
 *
 * E-cube needs every wire on its paths, so that nodes behind a missing one do
 * not answer.  When for ten seconds no further node has, a generation begins in
 * which each end names its links that never came up.  Four seconds later, if
 * the cube holds together without them, they are dead: one line each says so,
 * and the run goes on round them.  Where it does not hold together a node is
 * still to come, and the search begins anew every ten seconds.
 *
 * A wire that no path needs hides nobody.  So each node says with its answers
 * and its statistics which links have been up.  A wire of which both ends say
 * that it never was, three seconds and more after all nodes have answered, is
 * named as well; nothing else changes, as nothing needs it.  Time in which a
 * node does not answer does not count, so that a slow start is no alarm. */

/* patience_us: for nodes to come.  True: what the wiring has as dead is only
 * absent so far. */
bool host_missing_links_check(struct host_service *service, uint64_t now_us,
                              uint64_t patience_us);

/* Whether all nodes can do without what has been found dead.  Where they
 * cannot, those who are cut off by it are waited for as any silent node is, and
 * are noted as such. */
bool host_missing_links_spare(struct host_service *service);

/* A node has said which of its links have been up. */
void host_missing_links_heard(struct host_service *service, unsigned node,
                              uint32_t links);

/* At each check: names the wires that never came up, when it is time. */
void host_missing_links_look(struct host_service *service, uint64_t elapsed_us);

/* After the run: whether there is a wire of which it is not known yet. */
bool host_missing_links_awaited(const struct host_service *service);

#endif
