/* A mass-spring simulator in C, of another build than the C++ one: every derivative is written out by
 * components, and the linearized step is solved unreduced, for positions and velocities at once (4 n unknowns):
 *
 *     p - h d = 0          -h K p + (M - h B) d = h F          q' = q + h v + p,  v' = v + d
 *
 * It knows springs, gravitation and drag, has no explicit Euler but the symplectic, and refuses what it does
 * not know. Called as FOSSSim is: student -s scene.xml -d 0 -o trace.bin. MISTAKE, in the environment or as argument
 * `-e MISTAKE=name`, plants one mistake by its name; NAMES=one leaves each method only one name. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST 4000

static int n, n_edges, n_links;
static double mass[MOST], x[2 * MOST], v[2 * MOST], drag, gx, gy, h, duration;
static int edge[MOST][2], fixedp[MOST];
static struct { int spring, i, j; double a, b, c; } link[MOST];
static char method[64];
static double *K, *B, F[2 * MOST];

static int is(const char *name) {
  const char *mistake = getenv("MISTAKE");
  return mistake && !strcmp(mistake, name);
}
static void refuse(const char *what, const char *which) {
  fprintf(stderr, "student: %s %s\n", what, which);
  exit(1);
}

#define SPACE " \t\r\n"

/* An attribute's text, from behind its opening quote on; NULL if the tag has none of this name. */
static const char *attribute(const char *tag, const char *name) {
  const char *at = tag + strcspn(tag, SPACE "/>"), *quote;
  size_t length = strlen(name);
  while (*(at += strspn(at, SPACE)) != '/' && (quote = strpbrk(at, "\"'>")) && *quote != '>') {
    if (!strncmp(at, name, length) && strchr(SPACE "=", at[length])) return quote + 1;
    at = strchr(quote + 1, *quote) + 1;
  }
  return NULL;
}

static double number(const char *tag, const char *name, double otherwise) {
  const char *value = attribute(tag, name);
  return value ? strtod(value, NULL) : otherwise;
}

/* Reads an element if it is an edge, or if it is another one. */
static void element(const char *tag, int is_edge) {
  size_t length = strcspn(tag, SPACE "/>");
#define TAG(name) (length == strlen(name) && !strncmp(tag, name, length))
  if (TAG("edge") != is_edge) return;
  if (TAG("duration")) duration = number(tag, "time", 0);
  else if (TAG("integrator")) {
    const char *type = attribute(tag, "type");
    snprintf(method, sizeof method, "%.*s", (int)strcspn(type, "\"'"), type);
    h = number(tag, "dt", 0);
  } else if (TAG("particle")) {
    if (n >= MOST) refuse("too many", "particles");
    mass[n] = number(tag, "m", 1);
    x[2 * n] = number(tag, "px", 0), x[2 * n + 1] = number(tag, "py", 0);
    v[2 * n] = number(tag, "vx", 0), v[2 * n + 1] = number(tag, "vy", 0);
    fixedp[n++] = number(tag, "fixed", 0) != 0;
  } else if (TAG("edge")) {
    edge[n_edges][0] = number(tag, "i", 0), edge[n_edges++][1] = number(tag, "j", 0);
  } else if (TAG("springforce")) {
    int e = number(tag, "edge", 0);
    link[n_links].spring = 1, link[n_links].i = edge[e][0], link[n_links].j = edge[e][1];
    link[n_links].a = number(tag, "k", 0), link[n_links].b = number(tag, "l0", 0);
    link[n_links++].c = number(tag, "b", 0);
  } else if (TAG("gravitationalforce")) {
    link[n_links].spring = 0, link[n_links].i = number(tag, "i", 0), link[n_links].j = number(tag, "j", 0);
    link[n_links++].a = number(tag, "G", 0);
  } else if (TAG("dragdamping")) drag += number(tag, "b", 0);
  else if (TAG("simplegravity")) gx += number(tag, "fx", 0), gy += number(tag, "fy", 0);
  else if ((length > 5 && !strncmp(tag + length - 5, "force", 5)) || (length > 8 && !strncmp(tag + length - 8, "triangle", 8))) {
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)length, tag);
    refuse("unknown element", name);
  }
}

static void couple(double *M, int i, int j, double xx, double xy, double yx, double yy, int entry) {
  int s = 2 * n, a, b;
  double block[2][2] = {{xx, xy}, {yx, yy}};
  for (a = 0; a < 2; a++)
    for (b = 0; b < 2; b++) {
      double off = entry && a == 0 && b == 1 ? 1 + 1e-6 : 1;
      M[(2 * i + a) * s + 2 * i + b] += block[a][b];
      M[(2 * j + a) * s + 2 * j + b] += block[a][b];
      M[(2 * i + a) * s + 2 * j + b] -= block[a][b] * off;
      M[(2 * j + a) * s + 2 * i + b] -= is("block (j, i) transposed") ? block[b][a] : block[a][b];
    }
}

static void forces(const double *q) {
  int p, e, s = 2 * n;
  memset(F, 0, sizeof F);
  if (K) memset(K, 0, sizeof(double) * s * s), memset(B, 0, sizeof(double) * s * s);
  for (e = 0; e < n_links; e++) {
    int i = link[e].i, j = link[e].j;
    double dx = q[2 * i] - q[2 * j], dy = q[2 * i + 1] - q[2 * j + 1];
    double wx = v[2 * i] - v[2 * j], wy = v[2 * i + 1] - v[2 * j + 1];
    double r2 = dx * dx + dy * dy, r = sqrt(r2), fx, fy;
    if (link[e].spring) {
      double k = link[e].a, l0 = link[e].b, b = link[e].c, dw = dx * wx + dy * wy;
      /* in one place, only a spring with l0 = b = 0 has a force */
      if (r == 0) r = r2 = 1;
      if (is("length along x with a sign") && dy == 0) r = dx;
      /* f = -k (1 - l0/r) d - b (d.w) d / r2 */
      double c = k * (1 - l0 / r) + b * dw / r2;
      double g = is("l0/r² in dF/dx") ? k * l0 / r2 : k * l0 / (r2 * r);
      double t = 2 * b * dw / (r2 * r2), z = b / r2;
      if (is("dF/dx of 1/r² missing")) t = 0;
      fx = -c * dx, fy = -c * dy;
      if (K) {
        /* derivative of c by d: g d + z w - t d */
        double cx = g * dx + z * wx - t * dx, cy = g * dy + z * wy - t * dy;
        if (is("dF/dx of d·w missing")) cx -= z * wx, cy -= z * wy;
        couple(K, i, j, -c - cx * dx, -cy * dx, -cx * dy, -c - cy * dy, is("one cross entry off by 1e-6"));
        if (is("dF/dv along the velocity")) {
          double w2 = wx * wx + wy * wy;
          couple(B, i, j, -b * wx * wx / w2, -b * wx * wy / w2, -b * wx * wy / w2, -b * wy * wy / w2, 0);
        } else
          couple(B, i, j, -z * dx * dx, -z * dx * dy, -z * dx * dy, -z * dy * dy, 0);
      }
    } else {
      double c = link[e].a * mass[i] * mass[j] / (r2 * r);
      double three = is("2 for 3 in gravitation") ? 2 : 3;
      fx = -c * dx, fy = -c * dy;
      if (is("gravitation's force doubled, its Jacobian not")) fx *= 2, fy *= 2;
      if (K)
        couple(K, i, j, -c + three * c * dx * dx / r2, three * c * dx * dy / r2, three * c * dx * dy / r2,
               -c + three * c * dy * dy / r2, 0);
    }
    F[2 * i] += fx, F[2 * i + 1] += fy, F[2 * j] -= fx, F[2 * j + 1] -= fy;
  }
  for (p = 0; p < s; p++) {
    F[p] += mass[p / 2] * (p % 2 ? gy : gx) - drag * v[p];
    if (K) B[p * s + p] -= is("drag without its Jacobian") ? 0 : drag;
  }
}

static void solve(double *A, double *b, int s) {
  int k, r, c;
  for (k = 0; k < s; k++) {
    int best = k;
    for (r = k + 1; r < s; r++)
      if (fabs(A[r * s + k]) > fabs(A[best * s + k])) best = r;
    for (c = 0; c < s; c++) {
      double swap = A[k * s + c];
      A[k * s + c] = A[best * s + c], A[best * s + c] = swap;
    }
    double swap = b[k];
    b[k] = b[best], b[best] = swap;
    for (r = 0; r < s; r++) {
      double factor = A[r * s + k] / A[k * s + k];
      if (r == k || factor == 0) continue;
      for (c = k; c < s; c++) A[r * s + c] -= factor * A[k * s + c];
      b[r] -= factor * b[k];
    }
  }
  for (k = 0; k < s; k++) b[k] /= A[k * s + k];
}

static void step(void) {
  int s = 2 * n, r, c;
  int other_names = !getenv("NAMES");
  if (!strcmp(method, "forward-backward-euler") || (other_names && !strncmp(method, "symplectic", 10))) {
    forces(x);
    for (r = 0; r < s; r++) {
      if (!fixedp[r / 2]) v[r] += h * F[r] / mass[r / 2];
      x[r] += h * v[r];
    }
    return;
  }
  if (strncmp(method, "linearized-implicit", 19)) refuse("unknown integrator", method);
  K = malloc(sizeof(double) * s * s), B = malloc(sizeof(double) * s * s);
  double *A = calloc(4 * s * s, sizeof(double)), *b = calloc(2 * s, sizeof(double));
  static double ahead[2 * MOST];
  for (r = 0; r < s; r++) ahead[r] = x[r] + (is("no h v ahead") ? 0 : h * v[r]);
  forces(ahead);
  for (r = 0; r < s; r++) {
    A[r * 2 * s + r] = 1, A[r * 2 * s + s + r] = -h;
    for (c = 0; c < s; c++) {
      A[(s + r) * 2 * s + c] = -h * K[r * s + c];
      A[(s + r) * 2 * s + s + c] = -(is("h² B") ? h * h : h) * B[r * s + c];
    }
    A[(s + r) * 2 * s + s + r] += mass[r / 2];
    b[s + r] = h * F[r];
    if (fixedp[r / 2]) {
      for (c = 0; c < 2 * s; c++) A[(s + r) * 2 * s + c] = c == s + r;
      b[s + r] = 0;
    }
  }
  solve(A, b, 2 * s);
  for (r = 0; r < s; r++) x[r] += h * v[r] + b[r], v[r] += b[s + r];
  free(A), free(b), free(K), free(B);
  K = B = NULL;
}

int main(int count, char **arguments) {
  const char *scene = NULL, *output = NULL;
  int i, steps;
  for (i = 1; i + 1 < count; i += 2) {
    if (!strcmp(arguments[i], "-s")) scene = arguments[i + 1];
    if (!strcmp(arguments[i], "-o")) output = arguments[i + 1];
    if (!strcmp(arguments[i], "-e")) putenv(arguments[i + 1]);
  }
  FILE *file = scene ? fopen(scene, "rb") : NULL;
  if (!file || !output) refuse("usage:", "student -s scene.xml -d 0 -o trace.bin");
  static char text[1 << 22];
  text[fread(text, 1, sizeof text - 1, file)] = 0;
  for (int is_edge = 1; is_edge >= 0; is_edge--)  /* edges before the springs that name them */
    for (char *at = text; (at = strchr(at, '<')); at++) {
      if (!strncmp(at, "<!--", 4)) {
        if (!(at = strstr(at, "-->"))) break;
      } else if (at[1] != '/') element(at + 1, is_edge);
    }
  FILE *trace = fopen(output, "wb");
  steps = (int)ceil(duration / h);
  for (i = 0; i <= steps; i++) {
    if (i) step();
    fwrite(x, sizeof(double), 2 * n, trace);
    fwrite(v, sizeof(double), 2 * n, trace);
  }
  return fclose(trace);
}
