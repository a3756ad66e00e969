// A mass-spring simulator in one file, as a student of the course might write it: two dimensions, dense
// matrices. Called as FOSSSim is: student -s scene.xml -d 0 -o trace.bin
//
// REAL (a macro) is the type it computes with. The rest is set in the environment, or by arguments `-e NAME=VALUE`:
// SOLVER is lu, nopivot, krylov or gauss-seidel, to a TOLERANCE; ORDER=reversed sums forces backwards; START=state begins
// Newton's method at (q, v); FORMAT=csv writes text, numbers by DIGITS (%.17g); MISTAKE plants one mistake by its name.

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <unistd.h>

#ifndef REAL
#define REAL double
#endif

typedef REAL Real;
typedef std::vector<Real> Vec;
typedef std::map<std::string, std::string> Attributes;

static std::string setting(const char *name) {
  const char *value = std::getenv(name);
  return value ? value : "";
}
static std::string MISTAKE, SOLVER;
static bool is(const char *name) { return MISTAKE == name; }

[[noreturn]] static void refuse(const std::string &why) {
  std::fprintf(stderr, "student: %s\n", why.c_str());
  std::exit(1);
}

struct Mat {  // a 2 x 2 block
  Real a, b, c, d;
};
static Mat operator+(Mat m, Mat n) { return {m.a + n.a, m.b + n.b, m.c + n.c, m.d + n.d}; }
static Mat operator*(Real s, Mat m) { return {s * m.a, s * m.b, s * m.c, s * m.d}; }
static Mat operator*(Mat m, Mat n) {
  return {m.a * n.a + m.b * n.c, m.a * n.b + m.b * n.d, m.c * n.a + m.d * n.c, m.c * n.b + m.d * n.d};
}
static Mat transposed(Mat m) { return {m.a, m.c, m.b, m.d}; }
static Mat outer(const Real *u, const Real *v) { return {u[0] * v[0], u[0] * v[1], u[1] * v[0], u[1] * v[1]}; }
static const Mat I = {1, 0, 0, 1};
static const Mat R = {0, -1, 1, 0};
static const Mat O = {0, 0, 0, 0};

enum Kind { SPRING, GRAVITATION, VORTEX };
struct Pair {
  Kind kind;
  int i, j;
  Real p[3];
};

static int n;  // particles
static Vec mass, x, v;
static std::vector<bool> fixedp;
static std::vector<Pair> pairs;
static std::vector<int> edges;
static int elements;  // forces read
static Real drag, gravity[2], constant[2], h, duration;
static std::string method;

// The methods have shorter names as well.
static bool by(const char *name) {
  std::string full = method;
  if (full == "forward-backward-euler" || full == "symplectic") full = "symplectic-euler";
  if (full == "linearized-implicit") full = "linearized-implicit-euler";
  if (full == "implicit") full = "implicit-euler";
  return full == name;
}

// Force on i and its derivatives by d = x_i - x_j and w = v_i - v_j.
static void law(const Pair &e, const Real *d, const Real *w, Real *f, Mat *K, Mat *B) {
  Real l = std::sqrt(d[0] * d[0] + d[1] * d[1]);
  // In one place, only a spring with l0 = b = 0 has a force.
  if (l == 0) l = 1;
  Real nn[2] = {d[0] / l, d[1] / l};
  Real nw = nn[0] * w[0] + nn[1] * w[1];
  Mat along = outer(nn, nn), across = I + Real(-1) * along;
  f[0] = f[1] = 0;
  *K = *B = O;
  if (e.kind == SPRING) {
    Real k = e.p[0], l0 = e.p[1], b = e.p[2];
    Real lf = is("spring: force and Jacobian without l0") || is("spring: force without l0") ? Real(0) : l0;
    Real lj = is("spring: force and Jacobian without l0") || is("spring: Jacobian without l0") ? Real(0) : l0;
    Real kf = is("spring: half the stiffness in force and Jacobian") ? k / 2 : k;
    Real tension = -kf * (l - lf);
    for (int a = 0; a < 2; a++) f[a] = tension * nn[a];
    Mat elastic = -kf * (along + ((l - lj) / l) * across);
    if (is("spring: l0/l² in the Jacobian")) elastic = -k * (along + (1 - l0 / (l * l)) * across);
    if (is("spring: Jacobian's sign")) elastic = Real(-1) * elastic;
    if (is("spring: only n nᵀ in the Jacobian")) elastic = -k * along;
    if (is("spring: Jacobian off by 1e-6")) elastic = Real(1 + 1e-6) * elastic;
    *K = elastic;
    if (b != 0) {
      if (is("crash: segmentation fault with damping")) raise(SIGSEGV);
      if (is("damping: force and Jacobian not projected")) {
        for (int a = 0; a < 2; a++) f[a] -= b * w[a];
        *B = -b * I;
        return;
      }
      for (int a = 0; a < 2; a++) f[a] -= b * nw * nn[a];
      Mat turning = (nw * I + outer(nn, w)) * across;
      if (is("damping: dF/dx without (n·w) I")) turning = outer(nn, w) * across;
      if (is("damping: dF/dx without n wᵀ")) turning = nw * across;
      if (is("damping: dF/dx without the projection")) turning = nw * I + outer(nn, w);
      Mat part = (-b / l) * turning;
      if (is("damping: dF/dx missing")) part = O;
      if (is("damping: dF/dx has the wrong sign")) part = Real(-1) * part;
      if (is("damping: dF/dx transposed")) part = transposed(part);
      if (is("damping: dF/dx made symmetric")) part = Real(0.5) * (part + transposed(part));
      if (is("damping: dF/dx over l²")) part = (1 / l) * part;
      *K = *K + part;
      *B = -b * along;
      if (is("damping: dF/dv not projected")) *B = -b * I;
      if (is("damping: dF/dv missing")) *B = O;
      if (is("damping: dF/dv has the wrong sign")) *B = b * along;
    }
  } else if (e.kind == GRAVITATION) {
    Real s = e.p[0] * mass[e.i] * mass[e.j];
    if (is("gravitation: 1/l in force and Jacobian")) {
      for (int a = 0; a < 2; a++) f[a] = -s / l * nn[a];
      *K = (-s / (l * l)) * (I + Real(-2) * along);
      return;
    }
    for (int a = 0; a < 2; a++) f[a] = -s / (l * l) * nn[a];
    *K = (-s / (l * l * l)) * (I + Real(-3) * along);
    if (is("gravitation: l² for l³ in the Jacobian")) *K = l * *K;
    if (is("gravitation: n nᵀ without its 3")) *K = (-s / (l * l * l)) * across;
    if (is("gravitation: Jacobian's sign")) *K = Real(-1) * *K;
    if (is("gravitation: Jacobian missing")) *K = O;
    if (is("gravitation: Jacobian transposed")) *K = transposed(*K);
    if (is("gravitation: one entry off by 1e-6")) K->c *= Real(1 + 1e-6);
  } else {
    // The hand-out's direction goes from i to j, and its force is that on j.
    if (is("crash: exception in the vortex")) throw std::out_of_range("vortex");
    Real kbs = e.p[0], kvc = e.p[1], s = kvc / (l * l);
    if (is("vortex: rotates the other way")) kbs = -kbs;
    Real turned[2] = {-nn[1], nn[0]};
    for (int a = 0; a < 2; a++) f[a] = s * (kbs * turned[a] - w[a]);
    Mat swirl = kbs * (R + Real(-3) * (R * along)), viscous = Real(2) * outer(w, nn);
    if (is("vortex: 3 R n nᵀ missing")) swirl = kbs * R;
    if (is("vortex: no quarter turn")) swirl = kbs * (I + Real(-3) * along);
    if (is("vortex: w nᵀ transposed")) viscous = transposed(viscous);
    if (is("vortex: w nᵀ without its 2")) viscous = Real(0.5) * viscous;
    if (is("vortex: dF/dx without its drag part")) viscous = O;
    *K = (s / l) * (swirl + viscous);
    if (is("vortex: dF/dx over l²")) *K = l * *K;
    *B = -s * I;
    if (is("vortex: dF/dv over l")) *B = (-kvc / l) * I;
    if (is("vortex: dF/dv missing")) *B = O;
  }
}

static void add(std::vector<Real> &matrix, int row, int column, Mat m) {
  Real *at = &matrix[(2 * row) * (2 * n) + 2 * column];
  at[0] += m.a, at[1] += m.b;
  at += 2 * n;
  at[0] += m.c, at[1] += m.d;
}

// Forces, and where they are wanted both Jacobians.
static void evaluate(const Vec &q, const Vec &u, Vec &F, std::vector<Real> *K, std::vector<Real> *B) {
  F.assign(2 * n, 0);
  if (K) K->assign(4 * n * n, 0), B->assign(4 * n * n, 0);
  bool backwards = setting("ORDER") == "reversed";
  for (size_t index = 0; index < pairs.size(); index++) {
    const Pair &e = pairs[backwards ? pairs.size() - 1 - index : index];
    Real d[2] = {q[2 * e.i] - q[2 * e.j], q[2 * e.i + 1] - q[2 * e.j + 1]};
    Real w[2] = {u[2 * e.i] - u[2 * e.j], u[2 * e.i + 1] - u[2 * e.j + 1]};
    Real f[2];
    Mat A, D;
    law(e, d, w, f, &A, &D);
    // Volatile: GCC 12 vectorises two such casts, and leaves them out.
    volatile float narrow;
    for (int a = 0; a < 2 && is("precision: forces in single precision"); a++) narrow = f[a], f[a] = narrow;
    if (is("fixed: springs to them are left out") && (fixedp[e.i] || fixedp[e.j])) continue;
    for (int a = 0; a < 2; a++) F[2 * e.i + a] += f[a], F[2 * e.j + a] -= f[a];
    if (!K) continue;
    Mat cross = Real(-1) * A, crossv = Real(-1) * D, first = A;
    if (e.kind == SPRING && is("spring: cross blocks have the wrong sign")) cross = A;
    if (e.kind == SPRING && is("spring: cross blocks missing")) cross = O;
    if (e.kind == SPRING && is("spring: one entry off by 1e-6")) first.b *= Real(1 + 1e-6);
    if (e.kind == GRAVITATION && is("gravitation: cross blocks have the wrong sign")) cross = A;
    if (e.kind == VORTEX && is("vortex: cross blocks transposed")) cross = transposed(cross);
    if (e.kind == SPRING && is("damping: dF/dv without its cross blocks")) crossv = O;
    add(*K, e.i, e.i, first), add(*K, e.j, e.j, A), add(*K, e.i, e.j, cross), add(*K, e.j, e.i, cross);
    add(*B, e.i, e.i, D), add(*B, e.j, e.j, D), add(*B, e.i, e.j, crossv), add(*B, e.j, e.i, crossv);
  }
  for (int p = 0; p < n; p++) {
    Real m = mass[p], b = drag;
    if (is("drag: scaled by mass in force and Jacobian")) b *= m;
    for (int a = 0; a < 2; a++) {
      F[2 * p + a] += (is("gravity: not scaled by mass") ? 1 : m) * gravity[a] - b * u[2 * p + a];
      F[2 * p + a] += (is("constant force: scaled by mass") ? m : 1) * constant[a];
    }
    if (!K) continue;
    Real bj = b;
    if (is("drag: dF/dv scaled by mass")) bj = b * m;
    if (is("drag: dF/dv missing")) bj = 0;
    if (is("drag: dF/dv has the wrong sign")) bj = -b;
    if (is("drag: dF/dv off by 1e-6")) bj = b * Real(1 + 1e-6);
    add(*B, p, p, -bj * I);
    if (is("gravity: has a Jacobian") && gravity[0] != 0) add(*K, p, p, Real(1e-3) * I);
  }
}

static void lu(std::vector<Real> &A, Vec &b, bool pivot) {
  int size = b.size();
  for (int k = 0; k < size; k++) {
    int best = k;
    for (int r = k + 1; pivot && r < size; r++)
      if (std::fabs(A[r * size + k]) > std::fabs(A[best * size + k])) best = r;
    if (A[best * size + k] == 0) refuse("singular matrix");
    if (best != k) {
      for (int c = 0; c < size; c++) std::swap(A[k * size + c], A[best * size + c]);
      std::swap(b[k], b[best]);
    }
    for (int r = k + 1; r < size; r++) {
      Real factor = A[r * size + k] / A[k * size + k];
      if (factor == 0) continue;
      for (int c = k; c < size; c++) A[r * size + c] -= factor * A[k * size + c];
      b[r] -= factor * b[k];
    }
  }
  for (int k = size - 1; k >= 0; k--) {
    for (int c = k + 1; c < size; c++) b[k] -= A[k * size + c] * b[c];
    b[k] /= A[k * size + k];
  }
}

static Vec times(const std::vector<Real> &A, const Vec &u) {
  int size = u.size();
  Vec y(size, 0);
  for (int r = 0; r < size; r++)
    for (int c = 0; c < size; c++) y[r] += A[r * size + c] * u[c];
  return y;
}
static Real dot(const Vec &u, const Vec &w) {
  Real s = 0;
  for (size_t i = 0; i < u.size(); i++) s += u[i] * w[i];
  return s;
}

// Conjugate gradients of the normal equations: takes matrices that are not symmetric, too.
static void krylov(const std::vector<Real> &A, Vec &b, Real tolerance) {
  int size = b.size();
  std::vector<Real> T(size * size);
  for (int r = 0; r < size; r++)
    for (int c = 0; c < size; c++) T[c * size + r] = A[r * size + c];
  Vec u(size, 0), r = b, z = times(T, r), p = z;
  Real zz = dot(z, z), stop = tolerance * tolerance * dot(b, b);
  for (int iteration = 0; iteration < 100 * size && dot(r, r) > stop; iteration++) {
    Vec Ap = times(A, p);
    Real alpha = zz / dot(Ap, Ap);
    for (int i = 0; i < size; i++) u[i] += alpha * p[i], r[i] -= alpha * Ap[i];
    z = times(T, r);
    Real next = dot(z, z);
    for (int i = 0; i < size; i++) p[i] = z[i] + next / zz * p[i];
    zz = next;
  }
  b = u;
}

static void gauss_seidel(const std::vector<Real> &A, Vec &b, Real tolerance) {
  int size = b.size();
  Vec u(size, 0);
  for (int sweep = 0; sweep < 100000; sweep++) {
    Real change = 0, largest = 0;
    for (int r = 0; r < size; r++) {
      Real s = b[r];
      for (int c = 0; c < size; c++)
        if (c != r) s -= A[r * size + c] * u[c];
      s /= A[r * size + r];
      change = std::fmax(change, std::fabs(s - u[r]));
      largest = std::fmax(largest, std::fabs(s));
      u[r] = s;
    }
    if (change <= tolerance * largest) {
      b = u;
      return;
    }
    if (!(largest < 1e9)) break;
  }
  refuse("Gauss-Seidel does not converge");
}

static void explicit_step() {
  Vec F;
  evaluate(x, v, F, nullptr, nullptr);
  Vec old = v;
  bool falls = is("fixed: move with the forces under explicit methods");
  for (int i = 0; i < 2 * n; i++)
    if (!fixedp[i / 2] || falls) v[i] += h * F[i] / mass[i / 2];
  bool uses_old = by("explicit-euler") ? !is("explicit: position with the new velocity")
                                       : is("symplectic: position with the old velocity");
  for (int i = 0; i < 2 * n; i++) x[i] += h * (uses_old ? old[i] : v[i]);
}

// One system of Newton's method: (M - h^2 K - h B) d = -M (u - v) + h F. Returns d. At the state (q, v), which does not
// fulfil q = q^n + h u, elimination leaves h^2 K u on the right-hand side.
static Vec newton(const Vec &u, bool linearized, bool at_state) {
  Vec ahead = x, F;
  for (int i = 0; i < 2 * n; i++) ahead[i] += h * u[i];
  std::vector<Real> K, B, A(4 * n * n);
  evaluate(at_state || is("step: everything at q") || is("step: Jacobians at q") ? x : ahead, u, F, &K, &B);
  if (is("step: right-hand side at q")) evaluate(x, u, F, nullptr, nullptr);
  if (is("step: Jacobians at q")) evaluate(ahead, u, F, nullptr, nullptr);
  if (is("step: K and B swapped")) std::swap(K, B);
  int size = 2 * n;
  Real hk = h * h, hb = h, hf = h;
  if (is("step: h K for h² K")) hk = h;
  if (is("step: h² B for h B")) hb = h * h;
  if (is("step: no h before K and B")) hk = hb = 1;
  if (is("step: K's sign")) hk = -hk;
  if (is("step: B's sign")) hb = -hb;
  if (is("step: B left out")) hb = 0;
  if (is("step: no h on the right-hand side")) hf = 1;
  if (is("step: h² on the right-hand side")) hf = h * h;
  for (int r = 0; r < size; r++)
    for (int c = 0; c < size; c++) {
      int at = is("step: matrix transposed") ? c * size + r : r * size + c;
      A[r * size + c] = -hk * K[at] - hb * B[at];
      if (r == c) A[r * size + c] += is("step: no mass matrix") ? 1 : mass[r / 2];
      if (r == c && is("step: mass matrix off by 1e-3")) A[r * size + c] += mass[r / 2] * Real(1e-3);
    }
  Vec b(size);
  for (int r = 0; r < size; r++) b[r] = hf * F[r];
  for (int r = 0; at_state && r < size; r++)
    for (int c = 0; c < size; c++) b[r] += hk * K[r * size + c] * u[c];
  if (!linearized)
    for (int r = 0; r < size; r++) b[r] -= mass[r / 2] * (u[r] - v[r]);
  for (int p = 0; p < n; p++) {
    if (!fixedp[p]) continue;
    for (int r = 2 * p; r < 2 * p + 2; r++) {
      bool matrix = !is("fixed: only the right-hand side is cleared");
      for (int c = 0; matrix && c < size; c++) A[r * size + c] = A[c * size + r] = 0;
      if (matrix) A[r * size + r] = 1;
      if (!is("fixed: the right-hand side is not cleared")) b[r] = 0;
    }
  }
  std::string tolerance = setting("TOLERANCE");
  Real within = tolerance.empty() ? Real(1e-12) : Real(std::atof(tolerance.c_str()));
  if (SOLVER == "krylov") krylov(A, b, within);
  else if (SOLVER == "gauss-seidel") gauss_seidel(A, b, within);
  else lu(A, b, SOLVER != "nopivot");
  return b;
}

// Whether Newton's method may stop after a change d.
static bool is_small(const Vec &d) {
  if (is("newton: never stops")) return false;
  if (is("newton: stops at 1e-3")) return std::sqrt(dot(d, d)) < Real(1e-3);
  if (is("newton: looks at the first component only")) return std::fabs(d[0]) < Real(1e-9);
  Real sum = 0;
  for (Real c : d) sum += c;
  if (is("newton: adds the components up, signs and all")) return std::fabs(sum) < Real(1e-9);
  if (is("newton: the squared norm against 1e-5")) return dot(d, d) < Real(1e-5);
  return std::sqrt(dot(d, d)) < Real(1e-9);
}

static void step() {
  if (by("explicit-euler") || by("symplectic-euler")) return explicit_step();
  bool linearized = by("linearized-implicit-euler");
  if (!linearized && !by("implicit-euler")) refuse("no integrator " + method);
  if (linearized && is("crash: no linearized implicit Euler")) refuse("not implemented");
  if (!linearized && is("crash: implicit Euler aborts")) std::abort();
  if (linearized && is("crash: a matrix lost every linearized step")) {
    char *lost = static_cast<char *>(std::malloc(32 << 20));
    for (int at = 0; lost && at < 32 << 20; at += 4096) lost[at] = 1;
    if (!lost) refuse("no memory");
  }
  int most = linearized || is("newton: a single iteration") ? 1 : is("newton: two iterations") ? 2 : 50;
  if (is("newton: never stops") && !linearized) most = 2000000000;
  Vec u = v;
  for (int iteration = 0; iteration < most; iteration++) {
    bool at_state = !linearized && iteration == 0 && setting("START") == "state";
    Vec d = newton(u, linearized, at_state), before = u;
    for (int i = 0; i < 2 * n; i++) u[i] += d[i];
    if (linearized || !is_small(d)) continue;
    if (is("newton: returns the iterate before the last")) u = before;
    break;
  }
  v = u;
  for (int i = 0; i < 2 * n; i++) x[i] += h * v[i];
}

static Real number(const Attributes &a, const char *name, double otherwise) {
  Attributes::const_iterator found = a.find(name);
  return found == a.end() ? Real(otherwise) : Real(std::atof(found->second.c_str()));
}

static void element(const std::string &tag, const Attributes &a) {
  bool force = tag.find("force") != std::string::npos || tag.find("triangle") != std::string::npos || tag == "dragdamping" || tag == "simplegravity";
  if (force && elements++ > 0 && is("reading: only the first force")) return;
  if (tag == "duration") duration = is("reading: the duration is always 1 s") ? Real(1) : number(a, "time", 0);
  else if (tag == "integrator") {
    method = a.at("type"), h = number(a, "dt", 0);
    if (is("reading: dt is always 0.01")) h = Real(0.01);
    if (is("precision: dt in single precision")) h = float(h);
  }
  else if (tag == "particle") {
    n++;
    mass.push_back(is("reading: every mass is 1") ? Real(1) : number(a, "m", 1));
    x.push_back(number(a, "px", 0)), x.push_back(number(a, "py", 0));
    bool still = is("reading: velocities are left 0");
    v.push_back(still ? 0 : number(a, "vx", 0)), v.push_back(still ? 0 : number(a, "vy", 0));
    fixedp.push_back(number(a, "fixed", 0) != 0);
    if (fixedp.back() && is("crash: exception at a fixed particle")) throw std::runtime_error("fixed");
    if (fixedp.back() && is("fixed: stopped")) v[2 * n - 2] = v[2 * n - 1] = 0;
    if (is("fixed: not read")) fixedp.back() = false;
    if (a.count("pz")) refuse("no third dimension");
  } else if (tag == "edge") edges.push_back(number(a, "i", 0)), edges.push_back(number(a, "j", 0));
  else if (tag == "springforce") {
    int e = number(a, "edge", 0);
    pairs.push_back({SPRING, edges.at(2 * e), edges.at(2 * e + 1), {number(a, is("reading: l0 as k") ? "l0" : "k", 0), number(a, "l0", 0), number(a, "b", 0)}});
  } else if (tag == "gravitationalforce" && !is("crash: no gravitation"))
    pairs.push_back({GRAVITATION, int(number(a, "i", 0)), int(number(a, "j", 0)), {number(a, "G", 0), 0, 0}});
  else if (tag == "vortexforce")
    pairs.push_back({VORTEX, int(number(a, "i", 0)), int(number(a, "j", 0)), {number(a, "kbs", 0), number(a, "kvc", 0), 0}});
  else if (tag == "dragdamping") drag += number(a, "b", 0);
  else if (tag == "simplegravity") {
    gravity[0] += is("gravity: only along y") ? 0 : number(a, "fx", 0), gravity[1] += number(a, "fy", 0);
  }
  else if (tag == "constantforce") constant[0] += number(a, "fx", 0), constant[1] += number(a, "fy", 0);
  else if (force) refuse("no element " + tag);  // what only draws or describes is passed over
}

// Reads the edges, or all other elements.
static void parse(const std::string &text, bool edges) {
  for (size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    if (text.compare(at, 4, "<!--") == 0) at = text.find("-->", at);
    if (text[at + 1] == '/' || text[at + 1] == '?' || text[at] == '-') continue;
    size_t end = text.find_first_of(" \t\r\n/>", at + 1);
    std::string tag = text.substr(at + 1, end - at - 1);
    Attributes attributes;
    while (true) {
      size_t name = text.find_first_not_of(" \t\r\n/", end), open = text.find_first_of("\"'", name);
      if (text[name] == '>') break;  // a value may hold one
      size_t shut = text.find(text[open], open + 1);
      attributes[text.substr(name, text.find_first_of(" \t\r\n=", name) - name)] = text.substr(open + 1, shut - open - 1);
      end = shut + 1;
    }
    if ((tag == "edge") == edges) element(tag, attributes);
  }
}

// How many steps there are.
static int steps() {
  double ratio = double(duration) / double(h);
  if (is("states: the quotient rounded down")) return int(ratio);
  if (is("states: the quotient rounded to the nearest")) return int(std::floor(ratio + 0.5));
  if (is("states: time summed up to the duration")) {
    int count = 0;
    for (double t = 0; t < double(duration); t += double(h)) count++;
    return count;
  }
  int count = int(std::ceil(ratio));
  if (is("states: one too many")) count++;
  if (is("states: one too few")) count--;
  return count;
}

// Numbers of a state, in the order of the trace.
static std::vector<double> numbers(bool by_particle) {
  std::vector<double> all;
  bool backwards = is("output: particles in reverse order"), first_v = is("output: velocities before positions");
  if (is("output: grouped otherwise")) by_particle = !by_particle;
  for (int half = 0; half < (by_particle ? 1 : 2); half++)
    for (int k = 0; k < n; k++) {
      int p = backwards ? n - 1 - k : k;
      for (int part = 0; part < 2; part++) {
        if (!by_particle && part != half) continue;
        const Vec &of = (part == 0) != first_v ? x : v;
        all.push_back(of[2 * p]), all.push_back(of[2 * p + 1]);
      }
    }
  return all;
}

static void write_csv(std::ostream &trace, int s) {
  if (s == 0 && !is("output: no header")) {
    trace << (is("output: no time") ? "step" : "step,time");
    for (int p = 0; p < n; p++)
      for (const char *name : {"x", "y", "vx", "vy"}) trace << ',' << name << p;
    trace << '\n';
  }
  std::string digits = setting("DIGITS");
  if (digits.empty()) digits = "%.17g";
  char text[64];
  trace << s;
  if (!is("output: no time")) std::snprintf(text, sizeof text, "%.17g", s * double(h)), trace << ',' << text;
  for (double value : numbers(true)) {
    std::snprintf(text, sizeof text, digits.c_str(), value);
    if (is("output: decimal commas")) std::replace(text, text + sizeof text, '.', ',');
    trace << ',' << text;
  }
  trace << '\n';
}

static void write_binary(std::ostream &trace) {
  for (double value : numbers(false)) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    if (is("output: bytes in reverse order")) std::reverse(bytes, bytes + sizeof value);
    if (is("output: four bytes a number")) {
      float narrow = value;
      trace.write(reinterpret_cast<const char *>(&narrow), sizeof narrow);
    } else
      trace.write(bytes, sizeof value);
  }
}

int main(int count, char **arguments) {
  std::string scene, output;
  for (int i = 1; i + 1 < count; i += 2) {
    if (!std::strcmp(arguments[i], "-s")) scene = arguments[i + 1];
    if (!std::strcmp(arguments[i], "-o")) output = arguments[i + 1];
    if (!std::strcmp(arguments[i], "-e")) putenv(arguments[i + 1]);
  }
  MISTAKE = setting("MISTAKE"), SOLVER = setting("SOLVER");
  if (scene.empty()) refuse("usage: student -s scene.xml -d 0 -o trace.bin");
  std::ifstream file(scene);
  std::stringstream text;
  text << file.rdbuf();
  for (bool edges : {true, false}) parse(text.str(), edges);  // a spring may precede the edge that it names
  if (is("output: none, and status 0")) return 0;
  if (is("output: under another name")) output = "result.dat";
  if (is("output: to the standard output")) output = "/dev/stdout";
  std::ofstream trace(output, std::ios::binary);
  int last = steps();
  for (int s = 0; s <= last; s++) {
    if (s > 0) step();
    if (s == 0 && is("output: without the initial state")) continue;
    if (s == last && is("output: NaN at the end")) x[0] = NAN;
    if (is("precision: the state in single precision"))
      for (Vec *values : {&x, &v})
        for (Real &value : *values) value = float(value);
    if (setting("FORMAT") == "csv") write_csv(trace, s);
    else write_binary(trace);
  }
  if (is("output: cut off")) {
    long end = trace.tellp();
    trace.close();
    if (truncate(output.c_str(), end - 4 * n) != 0) refuse("cannot cut it off");
  }
  if (is("output: garbage behind the end")) trace << "done";
  return is("crash: status 1 with a right trace") ? 1 : 0;
}
