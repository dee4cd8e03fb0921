// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>

#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "comparison/sides.hpp"
#include "hotpath/core/csv.hpp"
#include "program/text.hpp"
#include "results/measures.hpp"

namespace hotpath::comparison {

namespace fs = std::filesystem;

namespace {

constexpr const char* kRemedy = "give a folder of `reproduce_paper.sh`";

/// The content of a file, compressed or not. Throws InputError.
std::string content_of(const fs::path& file) {
  static_cast<void>(open_input(file, kRemedy));  // a regular file
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> in(gzopen(file.c_str(), "rb"), gzclose);
  std::string content;
  std::array<char, 1 << 16> part{};
  int size = 0, error = Z_MEM_ERROR;
  while (in && (size = gzread(in.get(), part.data(), part.size())) > 0)
    content.append(part.data(), static_cast<std::size_t>(size));
  if (in) gzerror(in.get(), &error);
  if (error != Z_OK) refuse_input(file.string(), "it ends too early, or is damaged", kRemedy);
  return content;
}

/// The task's group of timers, or its own name.
std::string group_of(const std::string& task) {
  for (const char* const group : {"camera", "lidar", "imu"}) {
    if (strcasestr(task.c_str(), group) != nullptr) return group;
  }
  return task;
}

/// Calls `use` with a reader and the key of each row.
void for_each_row(const fs::path& file, std::optional<Latency> latency, const auto& use) {
  std::istringstream in(content_of(file));
  CsvReader rows(LineReader(in, file.string()));
  const char* const setting = latency == Latency::hot_path ? "load_percent" : "utilisation_percent";
  while (rows.next()) {
    const auto source = parse<Source>(rows.text("source"));
    if (!source) rows.fail("unknown `source`", "give `live` or `simulated`");
    const auto task = rows.find_column("task");
    use(rows, Key{latency, std::string(rows.text("study")), *source,
                  program::text("%g %%", rows.number<double>(setting)), std::string(rows.text("executor")),
                  task ? group_of(std::string(rows.text(*task))) : ""});
  }
}

}  // namespace

bool add_reproduction(const fs::path& folder, Side& side) {
  const fs::path data = folder / "data", hot_paths = data / "hot_path.csv.gz";
  if (!fs::exists(hot_paths)) return false;
  const auto read = [&](const fs::path& file, Latency latency, Measure measure, const char* value) {
    for_each_row(file, latency, [&](const CsvReader& rows, const Key& key) {
      const auto number = rows.number<std::int64_t>("repetition");
      const auto count = rows.number<std::size_t>("count");
      std::vector<double>& ms = side.samples[key].of(number);
      ms.insert(ms.end(), count, rows.number<double>(value));
      side.counts[{measure, key}][number] += static_cast<double>(count);
    });
  };
  read(hot_paths, Latency::hot_path, Measure::outputs, "hot_path_ms");
  read(data / "responses.csv.gz", Latency::response, Measure::jobs, "response_ms");
  if (fs::exists(data / "timers.csv")) {
    for_each_row(data / "timers.csv", std::nullopt, [&](const CsvReader& rows, Key key) {
      key.tasks.clear();
      side.counts[{Measure::losses, key}][rows.number<std::int64_t>("repetition")] +=
          rows.number<double>("skipped");
    });
  }
  if (fs::exists(folder / "facts.json")) {
    use_json(folder / "facts.json", "reproduce_paper.sh",
             [&](const nlohmann::json& facts) { facts.at("mode").get_to(side.mode); });
  }
  return true;
}

std::map<Key, double> drop_rates(const fs::path& folder) {
  std::map<Key, std::pair<std::uint64_t, std::uint64_t>> counts;  // skipped, reached
  if (fs::exists(folder / "data/timers.csv")) {
    for_each_row(folder / "data/timers.csv", std::nullopt, [&](const CsvReader& rows, const Key& key) {
      auto& [skipped, reached] = counts[key];
      skipped += rows.number<std::uint64_t>("skipped");
      reached += rows.number<std::uint64_t>("reached");
    });
  }
  std::map<Key, double> rates;
  for (const auto& [key, of] : counts) {
    if (of.second > 0) rates[key] = results::percent_of(of.first, of.second);
  }
  return rates;
}

}  // namespace hotpath::comparison
