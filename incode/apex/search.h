/* Searches of the whole set by the tree of boxes, the planes of the hull that
 * are known, and what the maker counts; shared by its parts.
 *
 * Memory: struct incode_search.  Work: stated at each.
 *
 *     incode_search_begin(m, s, face, pv, pb, pc, radius);
 *     while (incode_search_run(m, s) == INCODE_WAIT)
 *         deliver(s->query.missing);
 */
#ifndef INCODE_SEARCH_H
#define INCODE_SEARCH_H

#include "maker.h"

/* The fault of one who names a slot that its brick has not. */
#define INCODE_NO_VERTEX "a face has a vertex that its brick has not"

/* Begins the search of the apex of (v, b, c). */
void incode_search_begin(struct incode_maker *m, struct incode_search *s,
                         const uint32_t f[3], const double pv[3],
                         const double pb[3], const double pc[3], double radius);

/* Goes on with it: INCODE_ANSWERED with query.best (INCODE_NONE: a hull facet),
 * or INCODE_WAIT for query.missing, or INCODE_MORE: the walker has no units
 * left.
 */
enum incode_outcome incode_search_run(struct incode_maker *m,
                                      struct incode_search *s);

/* Notes what a walk waits for: INCODE_WAIT or INCODE_MORE, as above. */
enum incode_outcome incode_search_suspend(struct incode_search *s);

/* The next box of a search for a first candidate. */
void incode_search_box(struct incode_maker *m, struct incode_search *s);

/* The last look: every point that the best so far does not clearly beat, or
 * every point if there is none. */
void incode_search_last(struct incode_maker *m, struct incode_search *s);

/* Learns from the search of the apex of an open face that is over: where many
 * points were looked at, the sphere found helps the next ones. */
void incode_search_learn(struct incode_maker *m, const struct incode_query *q,
                         uint64_t looked);

/* Whether the face lies on a hull plane already certified, facing out. */
bool incode_hull_known(struct incode_maker *m, const double pv[3],
                       const double pb[3], const double pc[3]);

/* Remembers a hull facet; below: a place strictly on its known side. */
void incode_hull_remember(struct incode_maker *m, const struct incode_query *q,
                          const double below[3]);

/* Remembers a hull facet that a search has found. */
void incode_hull_learn(struct incode_maker *m, const struct incode_query *q);

/* The coordinates of a vertex; false: *page is missing. */
bool incode_fetch_point(struct incode_maker *m, uint32_t v, double p[3],
                        uint32_t *page);

/* Notes a MakeTetra that is over: how many candidates it looked at. */
void incode_count_candidates(struct incode_maker *m, uint64_t looked);

#endif
