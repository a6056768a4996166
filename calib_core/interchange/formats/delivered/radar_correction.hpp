// SPDX-License-Identifier: Apache-2.0
//
// Take a radar's known errors out of the positions that it reports. Written by cocalib; copy it into your software.
//
//     const auto correction = cocalib::RadarCorrection::read("folder of the pack");
//     const cocalib::Point true_m = correction.corrected({8.0, 1.5, 0.4});
//
// Then apply the pose: p_camera = R p_radar + t. Positions are in the radar frame: x forward, y left, z up [m].
// Azimuth is positive to the left, elevation is positive upwards.
//
// `read` needs radar_correction.csv and, if that names one, the file of the angle map, in one folder. It throws
// std::runtime_error if a file is missing or damaged. C++17, header only, the standard library only.

#ifndef COCALIB_RADAR_CORRECTION_HPP
#define COCALIB_RADAR_CORRECTION_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <locale>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace cocalib {

// A position in the radar frame [m].
struct Point {
  double x, y, z;
};

namespace detail {

struct Polar {
  double range_m, azimuth_rad, elevation_rad;
};

inline Polar polar(const Point& p) {
  return {std::hypot(p.x, p.y, p.z), std::atan2(p.y, p.x), std::atan2(p.z, std::hypot(p.x, p.y))};
}

inline Point cartesian(const Polar& p) {
  const double level_m = p.range_m * std::cos(p.elevation_rad);
  return {level_m * std::cos(p.azimuth_rad), level_m * std::sin(p.azimuth_rad), p.range_m * std::sin(p.elevation_rad)};
}

// Reads a number with a decimal point, whatever the locale of the program.
inline double number(const std::string& text, const std::string& file) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double value = 0.0;
  if (!(stream >> value)) throw std::runtime_error(file + ": '" + text + "' is not a number");
  return value;
}

// The rows of a CSV file without quotes, its header first.
inline std::vector<std::vector<std::string>> csv_rows(const std::string& file) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error(file + ": cannot be read; copy it from the pack");
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    std::vector<std::string> cells;
    std::istringstream words(line);
    for (std::string cell; std::getline(words, cell, ',');) cells.push_back(cell);
    if (!rows.empty() && cells.size() != rows.front().size())
      throw std::runtime_error(file + ": a line has another number of values than the first one");
    rows.push_back(cells);
  }
  if (rows.empty()) throw std::runtime_error(file + ": empty; copy it from the pack again");
  return rows;
}

inline std::size_t column(const std::vector<std::string>& header, const std::string& name, const std::string& file) {
  const auto found = std::find(header.begin(), header.end(), name);
  if (found == header.end()) throw std::runtime_error(file + ": the column " + name + " is missing");
  return static_cast<std::size_t>(found - header.begin());
}

}  // namespace detail

// Corrections to the radar's angles on a grid of directions: linear in between, constant beyond the edge.
class AngleMap {
 public:
  // Reads radar_angle_map.csv: one line for each direction of the grid.
  static AngleMap read(const std::string& file) {
    const auto rows = detail::csv_rows(file);
    std::array<std::size_t, 4> columns{};
    const std::array<const char*, 4> names{"elevation_rad", "azimuth_rad", "add_azimuth_rad", "add_elevation_rad"};
    for (std::size_t i = 0; i < 4; ++i) columns[i] = detail::column(rows.front(), names[i], file);
    std::map<double, std::map<double, Correction>> grid;  // by elevation, then azimuth
    for (std::size_t i = 1; i < rows.size(); ++i) {
      std::array<double, 4> values{};
      for (std::size_t j = 0; j < 4; ++j) values[j] = detail::number(rows[i][columns[j]], file);
      grid[values[0]][values[1]] = {values[2], values[3]};
    }
    AngleMap map;
    for (const auto& row : grid) {
      map.elevation_rad_.push_back(row.first);
      map.table_.emplace_back();
      for (const auto& cell : row.second) {
        if (row.first == grid.begin()->first) map.azimuth_rad_.push_back(cell.first);
        map.table_.back().push_back(cell.second);
      }
      if (map.table_.back().size() != map.azimuth_rad_.size() || map.azimuth_rad_.size() < 2)
        throw std::runtime_error(file + ": not a grid of directions; copy it from the pack again");
    }
    if (map.elevation_rad_.size() < 2 || rows.size() - 1 != map.elevation_rad_.size() * map.azimuth_rad_.size())
      throw std::runtime_error(file + ": not a grid of directions; copy it from the pack again");
    return map;
  }

  // The position with its angles corrected and its range kept.
  Point corrected(const Point& point) const {
    detail::Polar p = detail::polar(point);
    const Cell column = cell(azimuth_rad_, p.azimuth_rad), row = cell(elevation_rad_, p.elevation_rad);
    const auto between = [&](double Correction::*angle) {
      const auto along = [&](const std::vector<Correction>& line) {
        return line[column.below].*angle * (1.0 - column.share) + line[column.below + 1].*angle * column.share;
      };
      return along(table_[row.below]) * (1.0 - row.share) + along(table_[row.below + 1]) * row.share;
    };
    p.azimuth_rad += between(&Correction::azimuth_rad);
    p.elevation_rad += between(&Correction::elevation_rad);
    return detail::cartesian(p);
  }

 private:
  struct Correction {
    double azimuth_rad, elevation_rad;  // to add to a measured direction
  };

  // The grid line below a value, and the value's share of the way to the next one, 0 to 1.
  struct Cell {
    std::size_t below;
    double share;
  };

  static Cell cell(const std::vector<double>& lines, double value) {
    const double clamped = std::clamp(value, lines.front(), lines.back());
    const auto above = std::upper_bound(lines.begin() + 1, lines.end() - 1, clamped);
    const auto below = static_cast<std::size_t>(above - lines.begin()) - 1;
    return {below, (clamped - lines[below]) / (lines[below + 1] - lines[below])};
  }

  std::vector<double> azimuth_rad_, elevation_rad_;  // of the columns and the rows, ascending
  std::vector<std::vector<Correction>> table_;
};

// What is known of a radar's errors; all zero and no map for a radar without known errors.
struct RadarCorrection {
  double azimuth_scale = 0.0;      // reported azimuth over the true one, minus 1
  double elevation_scale = 0.0;    // the same of the elevation
  double range_bias_m = 0.0;       // reported range minus the true one
  double squared_height_m2 = 0.0;  // for a radar without elevation: of what it sees above or below its plane
  std::optional<AngleMap> angle_map;

  // Reads radar_correction.csv and the angle map that it names.
  static RadarCorrection read(const std::string& folder) {
    const std::string file = folder + "/radar_correction.csv";
    const auto rows = detail::csv_rows(file);
    const std::size_t name = detail::column(rows.front(), "name", file);
    const std::size_t value = detail::column(rows.front(), "value", file);
    std::map<std::string, std::string> values;
    for (std::size_t i = 1; i < rows.size(); ++i) values[rows[i][name]] = rows[i][value];
    const auto stated = [&](const std::string& key) {
      const auto found = values.find(key);
      if (found == values.end()) throw std::runtime_error(file + ": " + key + " is missing; copy it from the pack again");
      return found->second;
    };
    RadarCorrection correction;
    correction.azimuth_scale = detail::number(stated("azimuth_scale"), file);
    correction.elevation_scale = detail::number(stated("elevation_scale"), file);
    correction.range_bias_m = detail::number(stated("range_bias_m"), file);
    correction.squared_height_m2 = detail::number(stated("squared_height_m2"), file);
    const std::string map_file = stated("angle_map");
    if (map_file != "none") correction.angle_map = AngleMap::read(folder + "/" + map_file);
    return correction;
  }

  // The true position of a reported one.
  Point corrected(const Point& reported) const {
    detail::Polar p = detail::polar(reported);
    p.range_m -= range_bias_m;
    if (squared_height_m2 != 0.0)
      p.range_m = std::sqrt(std::max(p.range_m * p.range_m - squared_height_m2, 0.25 * p.range_m * p.range_m));
    p.azimuth_rad /= 1.0 + azimuth_scale;
    p.elevation_rad /= 1.0 + elevation_scale;
    const Point point = detail::cartesian(p);
    return angle_map ? angle_map->corrected(point) : point;
  }
};

}  // namespace cocalib

#endif  // COCALIB_RADAR_CORRECTION_HPP
