namespace sidestep::kernels {
namespace {

void mark(const RayEllipsoid& ellipsoid, const float* __restrict__ x, const float* __restrict__ y, const float* __restrict__ z,
          int count, float* __restrict__ front, float* __restrict__ arm) {
  const RayEllipsoid s = ellipsoid;
  const float never = s.hides ? 0.0f : __builtin_inff();
  for (int u = 0; u < count; ++u) {
    const float a = x[u] * (s.a[0] * x[u] + s.a[2] * y[u] + s.a[3]) + y[u] * (s.a[1] * y[u] + s.a[4]) + s.a[5];
    const float b = s.b[0] * x[u] + s.b[1] * y[u] + s.b[2];
    const float square = b * b - a * s.gamma;
    const float root = __builtin_sqrtf(square > 0.0f ? square : 0.0f);
    const float inverse = 1.0f / a;
    const float first = (b - root) * inverse, last = (b + root) * inverse;
    const float noise = s.constant + s.quadratic * z[u] * z[u];
    const bool hit = (square >= 0.0f) & (last > 0.0f);
    const float entry = first + never;
    front[u] = hit & (entry < front[u]) ? entry : front[u];
    arm[u] = hit & (z[u] > 0.0f) & (z[u] >= first - noise) & (z[u] <= last + noise) ? 1.0f : arm[u];
  }
}

void place(const Placement& placement, const float* __restrict__ x, const float* __restrict__ y, const float* __restrict__ z,
           int count, float* __restrict__ px, float* __restrict__ py, float* __restrict__ pz) {
  const Placement p = placement;
  for (int u = 0; u < count; ++u) {
    const float a = x[u] * z[u], b = y[u] * z[u], c = z[u];
    px[u] = p.R[0] * a + p.R[1] * b + p.R[2] * c + p.t[0];
    py[u] = p.R[3] * a + p.R[4] * b + p.R[5] * c + p.t[1];
    pz[u] = p.R[6] * a + p.R[7] * b + p.R[8] * c + p.t[2];
  }
}

void cells(const CellCube& cube, const float* __restrict__ x, const float* __restrict__ y, const float* __restrict__ z,
           int count, int* __restrict__ cells) {
  const CellCube c = cube;
  const float most = 2.0f * c.half * c.per_metre;
  for (int u = 0; u < count; ++u) {
    const float i = (x[u] - c.centre[0] + c.half) * c.per_metre, j = (y[u] - c.centre[1] + c.half) * c.per_metre,
                k = (z[u] - c.centre[2] + c.half) * c.per_metre;
    const bool inside = (i >= 0.0f) & (j >= 0.0f) & (k >= 0.0f) & (i < most) & (j < most) & (k < most);
    const float in_i = inside ? i : 0.0f, in_j = inside ? j : 0.0f, in_k = inside ? k : 0.0f;
    const int cell = c.begin + (static_cast<int>(in_k) * c.side + static_cast<int>(in_j)) * c.side + static_cast<int>(in_i);
    cells[u] = inside ? cell : cells[u];
  }
}

void compare(const float* __restrict__ z, const float* __restrict__ neighbour, const float* __restrict__ tolerance, int count,
             float* __restrict__ support, float* __restrict__ others) {
  for (int u = 0; u < count; ++u) {
    const bool agrees = __builtin_fabsf(z[u] - neighbour[u]) <= tolerance[u];
    support[u] += agrees ? 1.0f : 0.0f;
    others[u] += !agrees & (neighbour[u] > 0.0f) ? 1.0f : 0.0f;
  }
}

void steady(const SteadyRule& rule, const float* __restrict__ z, const unsigned char* __restrict__ label, int count,
            float* __restrict__ mean, float* __restrict__ images, float* __restrict__ drift, float* __restrict__ steady) {
  constexpr float share = 0.25f;  // of the newest image in the lasting difference: about seven images
  const SteadyRule s = rule;
  for (int u = 0; u < count; ++u) {
    const float noise = s.constant + s.quadratic * z[u] * z[u], away = z[u] - mean[u];
    const float lasting = drift[u] + share * (away / noise - drift[u]);
    const bool shows = label[u] == s.shows;
    const bool jumps = __builtin_fabsf(away) > s.jump * noise;
    const bool strays = jumps & (images[u] > 0.0f);  // once: the mean waits
    const bool waits = !shows | strays;
    const bool is_new = (images[u] == 0.0f) | jumps;
    const bool moves = __builtin_fabsf(lasting) > s.drift;
    const float held = __builtin_fabsf(images[u]), next = held + 1.0f, capped = next < s.most ? next : s.most;
    const float all = is_new ? 1.0f : moves ? 2.0f : capped;
    mean[u] = waits ? mean[u] : is_new ? z[u] : mean[u] + away / all;
    drift[u] = waits ? drift[u] : is_new | moves ? 0.0f : lasting;
    images[u] = !shows ? images[u] : strays ? -held : all;
    steady[u] = !waits & (all >= s.least) ? mean[u] : z[u];
  }
}

constexpr ImageKernel image_kernel{&mark, &place, &cells, &compare, &steady};

}  // namespace
}  // namespace sidestep::kernels
