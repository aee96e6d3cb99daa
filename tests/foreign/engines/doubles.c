/* An engine in floating point for `kinetile conform --command`: single casts (--ask casts --within D) and candidate
 * pairs (--ask pairs) of discs. All else is refused.
 *
 *     cc -O2 doubles.c -lm
 *
 * With -DFAULT=1 it reads the far end of an overlap, with -DFAULT=2 it sweeps over too few bodies. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef FAULT
#define FAULT 0
#endif

/* The numbers of the line after a place, up to another one; returns how many. */
static size_t numbers(const char *from, const char *to, double **all) {
    static size_t room;
    size_t n = 0;
    for (char *end; from < to; from = end > from ? end : from + 1) {
        double x = strtod(from, &end);
        if (end == from) continue;
        if (n == room) *all = realloc(*all, (room = 2 * room + 64) * sizeof(double));
        (*all)[n++] = x;
    }
    return n;
}

typedef struct { double number, x, y, r; } Disc;
static int by_left(const void *one, const void *two) {
    const Disc *a = one, *b = two;
    return (a->x - a->r > b->x - b->r) - (a->x - a->r < b->x - b->r);
}

static void pairs(Disc *disc, size_t n) {
    const char *between = "";
    qsort(disc, n, sizeof(Disc), by_left);
    printf("{\"pairs\": [");
    for (size_t i = 0; i < n; i++)
        for (size_t j = i + 1; j < n && disc[j].x - disc[j].r <= disc[i].x + disc[i].r; j++) {
            if (FAULT == 2 && j > i + 2) break;
            if (fabs(disc[j].y - disc[i].y) > (disc[i].r + disc[j].r) * (1 + 0x1p-50)) continue;
            printf("%s[%.0f, %.0f]", between, disc[i].number, disc[j].number);
            between = ", ";
        }
    printf("]}\n");
}

/* Of two bodies x, y, vx, vy, r, and until when. */
static void cast(const double *p, double until) {
    double dx = p[5] - p[0], dy = p[6] - p[1], vx = p[7] - p[2], vy = p[8] - p[3], reach = p[4] + p[9];
    double a = vx * vx + vy * vy, b = dx * vx + dy * vy, c = dx * dx + dy * dy - reach * reach;
    double under = b * b - a * c, time = c <= 0 ? 0 : FAULT == 1 ? (sqrt(under) - b) / a : c / (sqrt(under) - b);
    if (b < 0 && under > 0 && time <= until) printf("{\"time\": %.17g}\n", time);
    else printf("{\"time\": null}\n");
}

int main(void) {
    char *line = NULL, *place;
    size_t room = 0, n;
    double *p = NULL;
    while (getline(&line, &room, stdin) > 0) {
        const char *end = line + strlen(line);
        if ((place = strstr(line, "\"discs\":"))) {
            n = numbers(place, end, &p);
            pairs((Disc *)p, n / 4);
        } else if (strstr(line, "\"cast\":") && !strstr(line, "shape")) {
            n = numbers(line, end, &p);
            cast(p, p[n - 1]);
        } else printf("{\"refused\": \"it answers casts and moments of discs\"}\n");
        fflush(stdout);
    }
    return 0;
}
