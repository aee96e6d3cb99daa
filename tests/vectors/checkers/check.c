/* Checks a time of impact against the vectors: cc -O2 -o check check.c -lm && ./check [--exact] discs.txt
   Put your engine's call into time_of_impact; README.md describes the file and the errors. */

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct {
    double x, y, vx, vy, radius;
} Disc;

/* When two discs begin to touch, from 0 on, in units of time; below 0: never. This one is the quadratic in
   doubles. */
static double time_of_impact(Disc a, Disc b) {
    double dx = b.x - a.x, dy = b.y - a.y, vx = b.vx - a.vx, vy = b.vy - a.vy, reach = a.radius + b.radius;
    double approach = dx * vx + dy * vy, gap = dx * dx + dy * dy - reach * reach;
    if (approach >= 0) return -1;
    if (gap <= 0) return 0;
    double d = approach * approach - (vx * vx + vy * vy) * gap;
    return d > 0 ? gap / (sqrt(d) - approach) : -1;
}

enum { RIGHT, MISSED, INVENTED, OTHER };
static const char *grades[] = {"exact", "clear", "close"};

int main(int argc, char **argv) {
    int all = argc == 3 && strcmp(argv[1], "--exact") == 0, read, wrong = 0, e;
    FILE *file = argc == 2 + all ? fopen(argv[argc - 1], "r") : NULL;
    if (!file) return fprintf(stderr, "say: check [--exact] discs.txt\n"), 2;
    int counts[3][4] = {{0}};
    double worst[3] = {0};
    char grade[16], answer[32];
    Disc a, b;
    while ((read = fscanf(file, "%15s %*s %d %31s %la %la %la %la %la %la %la %la %la %la", grade, &e, answer, &a.x,
                          &a.y, &a.vx, &a.vy, &a.radius, &b.x, &b.y, &b.vx, &b.vy, &b.radius)) == 13) {
        int g = 0, kind = RIGHT;
        while (g < 2 && strcmp(grades[g], grade)) g++;
        double time = time_of_impact(a, b);
        long long tick;
        if (sscanf(answer, "%lld", &tick) != 1) {
            kind = time >= 0 ? INVENTED : RIGHT;
        } else if (!(time >= 0)) {
            kind = MISSED;
        } else {
            double found = floor(ldexp(time, 52 + e)); /* a tick is 2^-(52 + e) */
            kind = found < 0x1p62 && (long long)found == tick ? RIGHT : OTHER;
            worst[g] = fmax(worst[g], fabs(found - (double)tick));
        }
        counts[g][kind]++;
        wrong += kind != RIGHT && (all || g == 0 || (g == 1 && kind != OTHER));
    }
    if (read != EOF) return fprintf(stderr, "a line cannot be read\n"), 2;
    for (int g = 0; g < 3; g++)
        printf("%s: %d right, %d hits missed, %d misses hit, %d ticks wrong, by up to %g\n", grades[g],
               counts[g][RIGHT], counts[g][MISSED], counts[g][INVENTED], counts[g][OTHER], worst[g]);
    return wrong || !counts[0][RIGHT];
}
