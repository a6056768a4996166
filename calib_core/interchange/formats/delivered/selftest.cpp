// SPDX-License-Identifier: Apache-2.0
//
// Project ten radar points with the files of this pack and compare with the pixels in selftest.csv.
//
//     g++ -std=c++17 -O2 selftest.cpp -o selftest && ./selftest [FOLDER OF THE PACK]
//
// The pose is read from calibration.json, the lens from camera_info.yaml and the radar's errors from
// radar_correction.csv, so that the files a robot uses are what is tested. Prints PASS and returns 0 if every pixel
// agrees to a thousandth of a pixel; otherwise prints FAIL and returns 1. No library but the standard one.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "radar_correction.hpp"

namespace {

constexpr double kTolerancePx = 1e-3;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Pixel {
  double u, v;
};

std::string text_of(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error(file + ": cannot be read; copy it from the pack");
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

// The first `count` numbers after a key that stands after `from`; brackets and commas do not matter.
std::vector<double> numbers_after(const std::string& text, const std::string& key, std::size_t from, std::size_t count,
                                  const std::string& file) {
  std::size_t place = text.find(key, from);
  if (place == std::string::npos) throw std::runtime_error(file + ": " + key + " is missing; copy it from the pack again");
  place += key.size();
  std::vector<double> numbers;
  while (numbers.size() < count) {
    const std::size_t first = text.find_first_of("+-.0123456789", place);
    if (first == std::string::npos) throw std::runtime_error(file + ": too few numbers after " + key);
    place = text.find_first_of(",] \t\r\n", first);
    numbers.push_back(cocalib::detail::number(text.substr(first, place - first), file));
  }
  return numbers;
}

struct Pose {
  std::array<std::array<double, 3>, 3> rotation{};
  std::array<double, 3> translation_m{};

  static Pose read(const std::string& file) {
    const std::string text = text_of(file);
    const std::size_t from = text.find("\"camera_from_radar\":");
    if (from == std::string::npos) throw std::runtime_error(file + ": camera_from_radar is missing");
    const auto rotation = numbers_after(text, "\"rotation\":", from, 9, file);
    const auto translation = numbers_after(text, "\"translation_m\":", from, 3, file);
    Pose pose;
    for (std::size_t i = 0; i < 3; ++i) {
      pose.translation_m[i] = translation[i];
      for (std::size_t j = 0; j < 3; ++j) pose.rotation[i][j] = rotation[3 * i + j];
    }
    return pose;
  }

  // The point in the camera frame: x right, y down, z forward [m].
  cocalib::Point camera_from_radar(const cocalib::Point& p) const {
    const auto row = [&](std::size_t i) {
      return rotation[i][0] * p.x + rotation[i][1] * p.y + rotation[i][2] * p.z + translation_m[i];
    };
    return {row(0), row(1), row(2)};
  }
};

struct Camera {
  std::string model;                  // plumb_bob, rational_polynomial or equidistant
  std::vector<double> matrix_px;      // K, row by row
  std::array<double, 8> distortion{};  // zeros where the lens has fewer coefficients

  static Camera read(const std::string& file) {
    const std::string text = "\n" + text_of(file), key = "\ndistortion_model:";
    Camera camera;
    const std::size_t named = text.find(key);
    if (named != std::string::npos) std::istringstream(text.substr(named + key.size())) >> camera.model;
    const bool is_equidistant = camera.model == "equidistant";
    if (!is_equidistant && camera.model != "plumb_bob" && camera.model != "rational_polynomial")
      throw std::runtime_error(file + ": cannot project through the lens model '" + camera.model + "'");
    camera.matrix_px = list(text, "\ncamera_matrix:", 9, file);
    const std::size_t count = is_equidistant ? 4 : camera.model == "plumb_bob" ? 5 : 8;
    const auto coefficients = list(text, "\ndistortion_coefficients:", count, file);
    std::copy(coefficients.begin(), coefficients.end(), camera.distortion.begin());
    return camera;
  }

  // The pixel of a point in the camera frame, NaN where there is none; (0, 0) is the centre of the top-left pixel.
  Pixel project(const cocalib::Point& p) const {
    const auto [x, y] = model == "equidistant" ? equidistant(p) : perspective(p);
    const auto& k = matrix_px;
    return {k[0] * x + k[1] * y + k[2], k[3] * x + k[4] * y + k[5]};
  }

 private:
  static std::vector<double> list(const std::string& text, const std::string& key, std::size_t count,
                                  const std::string& file) {
    const std::size_t from = text.find(key);
    if (from == std::string::npos) throw std::runtime_error(file + ":" + key.substr(1) + " is missing");
    return numbers_after(text, "[", from, count, file);
  }

  Pixel perspective(const cocalib::Point& p) const {
    if (!(p.z > 0.0)) return {kNaN, kNaN};
    const auto& [k1, k2, p1, p2, k3, k4, k5, k6] = distortion;
    const double x = p.x / p.z, y = p.y / p.z, r2 = x * x + y * y;
    const double radial = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)));
    return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
  }

  Pixel equidistant(const cocalib::Point& p) const {
    const double across = std::hypot(p.x, p.y);
    if (across == 0.0) return p.z > 0.0 ? Pixel{0.0, 0.0} : Pixel{kNaN, kNaN};
    const double angle = std::atan2(across, p.z), a2 = angle * angle;
    const auto& k = distortion;
    const double radius = angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
    return {radius * p.x / across, radius * p.y / across};
  }
};

// Prints a line for each point, and returns the largest difference from selftest.csv; infinite if a pixel is missing.
double largest_difference_px(const std::string& folder) {
  const Pose pose = Pose::read(folder + "/calibration.json");
  const Camera camera = Camera::read(folder + "/camera_info.yaml");
  const auto correction = cocalib::RadarCorrection::read(folder);
  const std::string file = folder + "/selftest.csv";
  const auto rows = cocalib::detail::csv_rows(file);
  if (rows.size() < 2) throw std::runtime_error(file + ": no points; copy it from the pack again");
  const std::array<const char*, 7> names{"x_m", "y_m", "z_m", "u_raw_px", "v_raw_px", "u_px", "v_px"};
  double largest_px = 0.0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    std::array<double, 7> value{};
    for (std::size_t j = 0; j < 7; ++j)
      value[j] = cocalib::detail::number(rows[i][cocalib::detail::column(rows.front(), names[j], file)], file);
    const cocalib::Point reported{value[0], value[1], value[2]};
    const Pixel raw = camera.project(pose.camera_from_radar(reported));
    const Pixel full = camera.project(pose.camera_from_radar(correction.corrected(reported)));
    double off_px = 0.0;
    for (const double difference : {raw.u - value[3], raw.v - value[4], full.u - value[5], full.v - value[6]})
      off_px = std::isfinite(difference) ? std::max(off_px, std::abs(difference)) : std::numeric_limits<double>::infinity();
    largest_px = std::max(largest_px, off_px);
    std::printf(
        "(%8.3f, %8.3f, %8.3f) m -> pose only (%9.3f, %9.3f) px, with corrections (%9.3f, %9.3f) px, off by %.2g px\n",
        reported.x, reported.y, reported.z, raw.u, raw.v, full.u, full.v, off_px);
  }
  return largest_px;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    const double largest_px = largest_difference_px(count > 1 ? arguments[1] : ".");
    if (largest_px <= kTolerancePx) {
      std::printf("PASS: every pixel is as calibrated (largest difference %.2g px)\n", largest_px);
      return 0;
    }
    std::printf("FAIL: the largest difference is %.3g px, allowed are %g px\n", largest_px, kTolerancePx);
  } catch (const std::exception& error) {
    std::printf("FAIL: %s\n", error.what());
  }
  return 1;
}
