/* A naive engine in C for `kinetile conform --command`: discs with masses, in an arena or none. All else is
 * refused.
 *
 * Contacts are decided exactly, by the rules of docs/specification.md: doubles are whole numbers of a fine
 * grain, products of them have 1280 bits, and the tick of a contact is found by bisection. What does not fit
 * is refused too.
 *
 *     cc -O2 -ffp-contract=off engine.c -lm
 *
 * With -DTIMES it writes times in place of ticks, for `--within`; with -DFAULT=1 to 11 it has one of the faults
 * that the kit must find. */
#include <math.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef FAULT
#define FAULT 0
#endif
#define MOST 1000
#define LIMBS 20                   /* 1280 bits */
#define GRAIN 200                  /* a velocity is a whole number times 2^-GRAIN */
#define NEVER INT64_MAX
#define FAR ((int64_t)1 << 61)     /* from here on the clock anchors bodies: refused */

static jmp_buf refusal;
static const char *reason;
static void refuse(const char *why) { reason = why; longjmp(refusal, 1); }

/* Whole numbers modulo 2^1280, negative ones as two's complement. */
typedef struct { uint64_t w[LIMBS]; } Big;
static Big add(Big a, Big b) {
    unsigned __int128 carry = 0;
    for (int i = 0; i < LIMBS; i++) {
        carry += (unsigned __int128)a.w[i] + b.w[i];
        a.w[i] = (uint64_t)carry;
        carry >>= 64;
    }
    return a;
}
static Big whole(int64_t z) {
    Big a;
    for (int i = 0; i < LIMBS; i++) a.w[i] = i ? (z < 0 ? ~0ull : 0) : (uint64_t)z;
    return a;
}
static Big minus(Big a) { for (int i = 0; i < LIMBS; i++) a.w[i] = ~a.w[i]; return add(a, whole(1)); }
static Big sub(Big a, Big b) { return add(a, minus(b)); }
static Big mul(Big a, Big b) { /* quick where the first is small */
    Big c = whole(0);
    for (int i = 0; i < LIMBS; i++) {
        unsigned __int128 carry = 0;
        for (int j = 0; a.w[i] && i + j < LIMBS; j++) {
            carry += (unsigned __int128)a.w[i] * b.w[j] + c.w[i + j];
            c.w[i + j] = (uint64_t)carry;
            carry >>= 64;
        }
    }
    return c;
}
static int sign(Big a) {
    uint64_t any = 0;
    for (int i = 0; i < LIMBS; i++) any |= a.w[i];
    return a.w[LIMBS - 1] >> 63 ? -1 : any != 0;
}
/* x times 2^shift, which must be a whole number. */
static Big exact(double x, int shift) {
    int e;
    int64_t m = (int64_t)ldexp(frexp(x, &e), 53);
    if (m == 0) return whole(0);
    for (e += shift - 53; e < 0 && m % 2 == 0; e++) m /= 2;
    if (e < 0) refuse("a number is too small");
    Big power = whole(0);
    power.w[e / 64] = 1ull << e % 64;
    return mul(whole(m), power);
}

/* The scene, and the ticks to come: with[a][b] that of a pair a < b, side[a] that of a wall. */
typedef struct { double x[2], v[2], r, m; int64_t anchor; Big X[2], V[2], R; } Body;
static Body body[MOST];
static int n, walled, alike, fine, side_wall[MOST];
static double arena[2], until, q;
static int64_t with[MOST][MOST], side[MOST];
static char barred[MOST][MOST];

static const char *at;   /* what is left of the line */
static int take(char c) { at += strspn(at, " \t\r\n"); return *at == c ? (at++, 1) : 0; }
static void expect(char c) { if (!take(c)) refuse("the line is no scene of discs"); }
static const char *key(void) {
    static char word[32];
    expect('"');
    size_t length = strcspn(at, "\"");
    snprintf(word, sizeof word, "%.*s", (int)(length < 31 ? length : 31), at);
    at += length;
    expect('"'), expect(':');
    return word;
}
static double number(void) {
    char *end;
    double x = strtod(at, &end);
    if (end == at) refuse("it takes only numbers that are finite");
    at = end;
    return x;
}
static void pair(double *p) { expect('['), p[0] = number(), expect(','), p[1] = number(), expect(']'); }
static void read_body(void) {
    if (n == MOST) refuse("there are too many bodies");
    Body *b = &body[n++];
    *b = (Body){.m = 1};
    expect('{');
    do {
        const char *k = key();
        if (!strcmp(k, "position")) pair(b->x);
        else if (!strcmp(k, "velocity")) pair(b->v);
        else if (!strcmp(k, "radius")) b->r = number();
        else if (!strcmp(k, "mass")) b->m = number();
        else refuse("a body has more than a place, a velocity, a radius and a mass");
    } while (take(','));
    expect('}');
}
static void read_scene(const char *line) {
    at = line, n = walled = 0;
    expect('{');
    do {
        const char *k = key();
        if (!strcmp(k, "arena")) pair(arena), walled = 1;
        else if (!strcmp(k, "until")) until = number();
        else if (!strcmp(k, "start")) { if (number() != 0) refuse("it starts at 0 only"); }
        else if (!strcmp(k, "bodies")) {
            expect('[');
            if (!take(']')) { do read_body(); while (take(',')); expect(']'); }
        } else refuse("the scene has more than an arena, an end and bodies");
    } while (take(','));
    expect('}');
}

/* Rule 3: q. Places are whole numbers times 2^-fine, and so is what a velocity flies in a tick. */
static void clock_of_scene(void) {
    double S = 0, far = 0, r = 0;
    alike = 1;
    for (int i = 0; i < n; i++) {
        S = fmax(S, body[i].v[0] * body[i].v[0] + body[i].v[1] * body[i].v[1]);
        far = fmax(far, fmax(fabs(body[i].x[0]), fabs(body[i].x[1])));
        r = fmax(r, body[i].r);
        alike &= FAULT == 6 || body[i].m == body[0].m;
    }
    double c = sqrt(S) / (walled ? fmax(arena[0], arena[1]) : far + r) * (1 - 0x1p-20);
    int e = 0;
    while (n && c >= ldexp(1, e)) e++;
    if (walled) far = fmax(far, fmax(arena[0], arena[1]));
    if (e > 30 || far + r >= 0x1p40 || S >= 0x1p40) refuse("it is too fast or too far away");
    q = ldexp(1, -e - 52), fine = GRAIN + e + 52;
    if (until / q >= (double)FAR) refuse("it lasts too long");
}
/* Rule 4. */
static void anchor(Body *b, int64_t tick) {
    double d = (double)(tick - b->anchor) * q;
    for (int i = 0; i < 2; i++) b->x[i] = b->x[i] + b->v[i] * d;
    b->anchor = tick;
}
static Big dot(Big a[2], Big b[2]) { return add(mul(a[0], b[0]), mul(a[1], b[1])); }

/* Rule 5. The first zero of Q is not before a tick where Q >= 0 and B < 0. */
static int64_t pair_tick(const Body *a, const Body *b) {
    int64_t s = a->anchor > b->anchor ? a->anchor : b->anchor, low = 0, high = FAR;
    Big d[2], v[2], R = FAULT == 7 ? add(a->R, a->R) : add(a->R, b->R);
    for (int i = 0; i < 2; i++) {
        Big there = add(b->X[i], mul(whole(s - b->anchor), b->V[i]));
        d[i] = sub(there, add(a->X[i], mul(whole(s - a->anchor), a->V[i])));
        v[i] = sub(b->V[i], a->V[i]);
    }
    Big B = dot(d, v);
    if (sign(B) >= (FAULT == 1 ? 1 : 0)) return NEVER;
    Big Q = sub(dot(d, d), mul(R, R));
    if (sign(Q) <= 0) return s;
    if (sign(sub(mul(B, B), mul(dot(v, v), Q))) <= 0) return NEVER;
    while (high - low > 1) {
        int64_t middle = low + (high - low) / 2;
        Big then[2];
        for (int i = 0; i < 2; i++) then[i] = add(d[i], mul(whole(middle), v[i]));
        *(sign(dot(then, v)) < 0 && sign(sub(dot(then, then), mul(R, R))) >= 0 ? &low : &high) = middle;
    }
    return s + (FAULT == 5 ? high : low);
}

/* Rule 6. */
static void wall_tick(int k) {
    Body *b = &body[k];
    side[k] = NEVER;
    for (int i = 0; walled && i < 2; i++) {
        int ahead = sign(b->V[i]), wall = -1 - 2 * i - (ahead > 0);
        if (ahead == 0 || (FAULT == 4 && wall == -4)) continue;
        Big gap = sub(ahead > 0 ? sub(exact(arena[i], fine), b->X[i]) : b->X[i], b->R);
        Big speed = ahead > 0 ? b->V[i] : minus(b->V[i]);
        int64_t low = 0, high = FAR;
        while (sign(gap) > 0 && high - low > 1) {
            int64_t middle = low + (high - low) / 2;
            *(sign(sub(gap, mul(whole(middle), speed))) >= 0 ? &low : &high) = middle;
        }
        if (b->anchor + low < side[k]) side[k] = b->anchor + low, side_wall[k] = wall;
    }
}

static void predict(int k) {
    wall_tick(k);
    for (int j = 0; j < n - (FAULT == 2); j++) {
        int a = j < k ? j : k, b = j < k ? k : j;
        if (a < b) with[a][b] = barred[a][b] ? NEVER : pair_tick(&body[a], &body[b]);
    }
}
/* What follows from a new plan; `unbarred` ends the bars of rule 7. */
static void new_plan(int k, int unbarred) {
    for (int i = 0; i < 2; i++) {
        if (fabs(body[k].v[i]) >= 0x1p20) refuse("it is too fast");
        body[k].X[i] = exact(body[k].x[i], fine), body[k].V[i] = exact(body[k].v[i], GRAIN);
    }
    for (int j = 0; unbarred && j < n; j++) barred[j][k] = barred[k][j] = 0;
}

/* Rule 9. */
static double E(double a, double b) { return fma(a, b, -(a * b)); }
static double share(double m, double o, double speed) {
    double both = m + o, part = both - m, low = (m - (both - part)) + (o - part), f = 2 * o / both;
    double back = f * both, rest = ((2 * o - back) - E(f, both) - low * f) / both, taken = f * speed;
    return taken + (E(f, speed) + rest * speed);
}
static int exchange(Body *a, Body *b) {
    double dx = b->x[0] - a->x[0], dy = b->x[1] - a->x[1], l = sqrt(dx * dx + dy * dy);
    if (l == 0) return 0;
    double nx = dx / l, ny = dy / l, ux = b->v[0] - a->v[0], uy = b->v[1] - a->v[1];
    double xx = nx * nx, yy = ny * ny;
    double excess = ((xx - 0.5) + (yy - 0.5)) + (E(nx, nx) + E(ny, ny));
    double px = ux * nx, py = uy * ny, sum = px + py, part = sum - px;
    double low = ((px - (sum - part)) + (py - part)) + (E(ux, nx) + E(uy, ny));
    double speed = FAULT == 8 ? sum : sum + (low - sum * excess);
    double ga = alike ? speed : share(a->m, b->m, speed), gb = alike ? speed : share(b->m, a->m, speed);
    a->v[0] = a->v[0] + ga * nx, a->v[1] = a->v[1] + ga * ny;
    b->v[0] = b->v[0] - gb * nx, b->v[1] = b->v[1] - gb * ny;
    return 1;
}

/* Rule 8: the next event, until the end. */
static void run(FILE *answer) {
    int64_t end = (int64_t)(until / q);
    const char *between = "";
    for (int k = 0; k < n; k++) {
        body[k].R = exact(body[k].r, fine);
        new_plan(k, FAULT != 11);
    }
    for (int k = 0; k < n; k++) predict(k);
    for (;;) {
        int64_t tick = NEVER;
        int one = 0, other = 0;
        for (int a = 0; a < n; a++)
            if (side[a] < tick) tick = side[a], one = a, other = side_wall[a];
        for (int a = 0; a < n - (FAULT == 2); a++)
            for (int b = a + 1; b < n - (FAULT == 2); b++)
                if (with[a][b] < tick + (FAULT == 3 && tick < NEVER)) tick = with[a][b], one = a, other = b;
        if (tick > end - (FAULT == 10)) return;
        anchor(&body[one], tick);
        if (other < 0) {
            double *v = &body[one].v[other < -2];
            *v = -*v;
            new_plan(one, FAULT != 9);
        } else {
            anchor(&body[other], tick);
            if (!exchange(&body[one], &body[other])) return;
            new_plan(one, 1), new_plan(other, 1);
            barred[one][other] = 1;
            predict(other);
        }
        predict(one);
#ifdef TIMES
        fprintf(answer, "%s[%.17g, %d, %d]", between, (double)tick * q, one, other);
#else
        fprintf(answer, "%s[%lld, %lld, %d, %d]", between, (long long)(tick >> 52),
                (long long)(tick & (((int64_t)1 << 52) - 1)), one, other);
#endif
        between = ", ";
    }
}

int main(void) {
    char *line = NULL, *text;
    size_t room = 0, length;
    while (getline(&line, &room, stdin) > 0) {
        FILE *answer = open_memstream(&text, &length);
        if (setjmp(refusal)) {
            printf("{\"refused\": \"%s\"}\n", reason);
        } else {
            read_scene(line);
            clock_of_scene();
            run(answer);
            fflush(answer);
            printf("{\"contacts\": [%s]}\n", text);
        }
        fclose(answer), free(text);
        fflush(stdout);
    }
    return 0;
}
