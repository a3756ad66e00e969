// The fast mass-spring assignment, as its hand-out states it: signed incidence matrix, one factorisation, 50 rounds of
// local and global steps, pins by a penalty of 1e10. Called as `program SCENE TRACE`; writes positions alone. Two further
// arguments are the largest number of particles, and 1 if wind is not implemented.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

typedef std::vector<double> Row;
typedef std::vector<Row> Matrix;

static std::string read_file(const std::string &path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

static std::string value_of(const std::string &json, const std::string &key) {
  size_t name = json.find("\"" + key + "\"");
  if (name == std::string::npos) return "";
  size_t start = json.find_first_not_of(" \t\r\n", json.find(':', name) + 1);
  size_t end = json[start] == '[' ? json.find(']', start) : json.find_first_of(",}", start);
  return json.substr(start, end - start);
}

// Voronoi areas of the triangulated mesh, mixed for obtuse triangles.
static void add_areas(const Matrix &p, int a, int b, int c, Row &mass) {
  int corner[3] = {a, b, c};
  double squared[3], cotangent[3];
  for (int k = 0; k < 3; k++) {
    const Row &u = p[corner[(k + 1) % 3]], &w = p[corner[(k + 2) % 3]];
    squared[k] = 0;
    for (int d = 0; d < 3; d++) squared[k] += (u[d] - w[d]) * (u[d] - w[d]);
  }
  double s = 0;
  for (int k = 0; k < 3; k++) s += std::sqrt(squared[k]) / 2;
  double area = s;
  for (int k = 0; k < 3; k++) area *= s - std::sqrt(squared[k]);
  area = std::sqrt(area);
  int obtuse = -1;
  for (int k = 0; k < 3; k++) {
    double opposite = squared[(k + 1) % 3] + squared[(k + 2) % 3] - squared[k];
    cotangent[k] = opposite / (4 * area);
    if (opposite < 0) obtuse = k;
  }
  for (int k = 0; k < 3; k++) {
    double share = obtuse < 0 ? (squared[(k + 1) % 3] * cotangent[(k + 1) % 3] + squared[(k + 2) % 3] * cotangent[(k + 2) % 3]) / 8
                              : area / (obtuse == k ? 2 : 4);
    mass[corner[k]] += share;
  }
}

int main(int count, char **arguments) {
  if (count != 3 && count != 5) return 2;
  int largest = count == 5 ? std::atoi(arguments[3]) : 1000;
  bool refuses_wind = count == 5 && std::atoi(arguments[4]) == 1;
  std::string json = read_file(arguments[1]);
  double k = std::atof(value_of(json, "k").c_str()), m = std::atof(value_of(json, "m").c_str());
  bool wind = value_of(json, "wind").rfind("true", 0) == 0;
  if (wind && refuses_wind) {
    std::cerr << "wind is not implemented\n";
    return 1;
  }
  std::string pins = value_of(json, "b"), mesh = value_of(json, "obj");
  for (char &character : pins)
    if (character == '[' || character == ',') character = ' ';
  std::vector<int> pinned;
  std::istringstream list(pins);
  for (int vertex; list >> vertex;) pinned.push_back(vertex - 1);

  Matrix rest;
  std::vector<std::pair<int, int> > springs;
  std::set<std::pair<int, int> > known;
  std::vector<std::vector<int> > faces;
  std::istringstream lines(read_file(mesh.substr(1, mesh.rfind('"') - 1)));
  for (std::string line, kind, corner; std::getline(lines, line);) {
    std::istringstream words(line);
    words >> kind;
    if (kind == "v") {
      Row v(3);
      words >> v[0] >> v[1] >> v[2];
      rest.push_back(v);
    } else if (kind == "f") {
      std::vector<int> face;
      while (words >> corner) face.push_back(std::atoi(corner.c_str()) - 1);
      faces.push_back(face);
      for (size_t a = 0; a < face.size(); a++)
        for (size_t b = a + 1; b < face.size(); b++) {
          std::pair<int, int> pair(std::min(face[a], face[b]), std::max(face[a], face[b]));
          if (known.insert(pair).second) springs.push_back(pair);
        }
    }
    kind.clear();
  }
  int n = rest.size();
  if (n > largest) {
    std::cerr << "too large for this program\n";
    return 1;
  }
  Row mass(n, m);
  if (m == 0)
    for (const std::vector<int> &face : faces)
      for (size_t c = 2; c < face.size(); c++) add_areas(rest, face[0], face[c - 1], face[c], mass);

  double h = 1.0 / 30, weight = 1e10;
  Row lengths;
  Matrix L(n, Row(n, 0));
  for (int i = 0; i < n; i++) L[i][i] = mass[i] / (h * h);
  for (const std::pair<int, int> &spring : springs) {
    int i = spring.first, j = spring.second;
    double squared = 0;
    for (int d = 0; d < 3; d++) squared += (rest[i][d] - rest[j][d]) * (rest[i][d] - rest[j][d]);
    lengths.push_back(std::sqrt(squared));
    L[i][i] += k, L[j][j] += k, L[i][j] -= k, L[j][i] -= k;
  }
  for (int i : pinned) L[i][i] += weight;
  for (int j = 0; j < n; j++) {  // Cholesky
    for (int c = 0; c < j; c++)
      for (int i = j; i < n; i++) L[i][j] -= L[i][c] * L[j][c];
    double pivot = std::sqrt(L[j][j]);
    for (int i = j; i < n; i++) L[i][j] /= pivot;
  }

  double low[3], high[3], diagonal = 0;
  for (int d = 0; d < 3; d++) {
    low[d] = high[d] = rest[0][d];
    for (const Row &v : rest) low[d] = std::min(low[d], v[d]), high[d] = std::max(high[d], v[d]);
    diagonal += (high[d] - low[d]) * (high[d] - low[d]);
  }
  diagonal = std::sqrt(diagonal);

  std::ofstream trace(arguments[2]);
  trace.precision(17);
  trace << "step,time";
  for (int i = 0; i < n; i++) trace << ",x" << i << ",y" << i << ",z" << i;
  trace << "\n";
  Matrix p = rest, old = rest;
  for (int number = 0; number <= 30; number++) {
    if (number > 0) {
      double t = (number - 1) * h;
      Matrix y(n, Row(3, 0)), now = p;
      for (int i = 0; i < n; i++) {
        double force[3] = {0, -9.8, 0};
        if (wind) {
          double phi = p[i][0] / diagonal + t;
          force[0] += 3 + 1.5 * (1 + std::cos(5 * phi));
          force[1] += 1 + std::cos(0.3 + phi);
          force[2] += std::sin(phi);
        }
        for (int d = 0; d < 3; d++) y[i][d] = mass[i] / (h * h) * (2 * p[i][d] - old[i][d]) + force[d];
      }
      for (int i : pinned)
        for (int d = 0; d < 3; d++) y[i][d] += weight * rest[i][d];
      for (int round = 0; round < 50; round++) {
        Matrix b = y;
        for (size_t s = 0; s < springs.size(); s++) {
          int i = springs[s].first, j = springs[s].second;
          double v[3], squared = 0;
          for (int d = 0; d < 3; d++) v[d] = p[i][d] - p[j][d], squared += v[d] * v[d];
          for (int d = 0; d < 3; d++) {
            double part = k * lengths[s] * v[d] / std::sqrt(squared);
            b[i][d] += part, b[j][d] -= part;
          }
        }
        for (int d = 0; d < 3; d++) {
          for (int i = 0; i < n; i++) {
            for (int c = 0; c < i; c++) b[i][d] -= L[i][c] * b[c][d];
            b[i][d] /= L[i][i];
          }
          for (int i = n - 1; i >= 0; i--) {
            for (int c = i + 1; c < n; c++) b[i][d] -= L[c][i] * b[c][d];
            b[i][d] /= L[i][i];
          }
        }
        p = b;
      }
      old = now;
    }
    trace << number << "," << number * h;
    for (const Row &v : p) trace << "," << v[0] << "," << v[1] << "," << v[2];
    trace << "\n";
  }
  return trace.good() ? 0 : 1;
}
