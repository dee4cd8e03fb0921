// SPDX-License-Identifier: Apache-2.0
#include "results/processor_speed.hpp"

#include <algorithm>

#include "program/text.hpp"

namespace hotpath::results {
namespace {

/// The least busy time of a judged window, so that a preemption of a few milliseconds does not look
/// like a slow CPU.
constexpr Duration kLeastBusy = std::chrono::milliseconds(200);
constexpr double kFastest = 0.2;
/// A longer job spans a suspension of the machine, or comes from an invalid file.
constexpr Duration kLongestJob = std::chrono::minutes(10);

double pace(const SpeedWindow& w) {
  return static_cast<double>(w.busy.count()) / static_cast<double>(w.work.count());
}

Duration share(Duration whole, Duration part, Duration of) {
  return Duration(
      static_cast<std::int64_t>(static_cast<double>(whole.count()) *
                                (static_cast<double>(part.count()) / static_cast<double>(of.count()))));
}

/// Merges the windows of each CPU until they have kLeastBusy; the rest is merged into the last
/// window.
std::vector<SpeedWindow> judged_windows(std::span<const SpeedWindow> windows) {
  std::map<int, std::vector<SpeedWindow>> by_cpu;
  for (const SpeedWindow& w : windows) {
    std::vector<SpeedWindow>& judged = by_cpu[w.cpu];
    if (judged.empty() || judged.back().busy >= kLeastBusy) {
      judged.push_back(w);
    } else {
      judged.back().end = w.end;
      judged.back().busy += w.busy;
      judged.back().work += w.work;
    }
  }
  std::vector<SpeedWindow> all;
  for (auto& [cpu, judged] : by_cpu) {
    if (judged.back().busy < kLeastBusy) {
      const SpeedWindow rest = judged.back();
      judged.pop_back();
      if (judged.empty()) continue;
      judged.back().end = rest.end;
      judged.back().busy += rest.busy;
      judged.back().work += rest.work;
    }
    all.insert(all.end(), judged.begin(), judged.end());
  }
  return all;
}

}  // namespace

void SpeedWatch::add(const JobRecord& job) {
  if (job.outcome != Outcome::ran || job.cpu < 0) return;
  const Duration begin = job.start - epoch_, end = job.finish - epoch_;
  if (end - begin > kLongestJob) return;
  if (begin < window_ && spans_.empty()) return;  // in the warm-up
  while (begin >= window_ + kWindow) {
    if (spans_.empty()) {
      window_ += (begin - window_) / kWindow * kWindow;
    } else {
      close_window();
    }
  }
  // The callback of a node that waits for other inputs executes no work, so its job is much
  // shorter.
  const Duration work = set_[job.job.task].wcet;
  const bool known = work >= kLeastJob && end - begin >= work / 2;
  seen_[job.worker].insert(job.cpu);
  spans_.push_back({begin, end, known ? work + kOverhead : end - begin, known, job.worker, job.cpu});
}

/// On CPUs whose threads never ran on another CPU, overlapping jobs share the CPU's time. Other
/// threads may have migrated within a job, so only their jobs without overlap count.
std::vector<SpeedWindow> SpeedWatch::finish() && {
  while (!spans_.empty()) close_window();
  std::set<int> visited;
  for (const auto& [worker, cpus] : seen_) {
    if (cpus.size() > 1) visited.insert(cpus.begin(), cpus.end());
  }
  std::erase_if(shared_, [&](const SpeedWindow& w) { return visited.contains(w.cpu); });
  std::erase_if(alone_, [&](const SpeedWindow& w) { return !visited.contains(w.cpu); });
  shared_.insert(shared_.end(), alone_.begin(), alone_.end());
  return std::move(shared_);
}

void SpeedWatch::close_window() {
  const Duration end = window_ + kWindow;
  std::vector<Span> all;
  std::map<int, std::vector<Span>> by_cpu;
  for (Span span : spans_) {
    const Duration whole = span.end - span.begin;
    span.begin = std::max(span.begin, window_);
    span.end = std::min(span.end, end);
    if (span.end <= span.begin) continue;
    span.work = share(span.work, span.end - span.begin, whole);
    all.push_back(span);
    by_cpu[span.cpu].push_back(span);
  }
  Windows shared, alone;
  for (const auto& [cpu, spans] : by_cpu) measure(spans, spans.size(), shared);
  measure(all, 1, alone);
  for (const auto& [cpu, window] : shared) shared_.push_back(window);
  for (const auto& [cpu, window] : alone) alone_.push_back(window);
  std::erase_if(spans_, [&](const Span& span) { return span.end <= end; });
  window_ = end;
}

/// `spans`: in order of their begin. Overlapping spans count together if there are at most `most`
/// of them.
void SpeedWatch::measure(const std::vector<Span>& spans, std::size_t most, Windows& windows) const {
  for (std::size_t first = 0, next = 0; first < spans.size(); first = next) {
    Duration end = spans[first].end, work{};
    bool known = false;
    for (next = first; next < spans.size() && (next == first || spans[next].begin < end); ++next) {
      end = std::max(end, spans[next].end);
      work += spans[next].work;
      known |= spans[next].known;
    }
    if (!known || next - first > most) continue;
    SpeedWindow& window = windows[spans[first].cpu];
    window.cpu = spans[first].cpu;
    window.begin = window_;
    window.end = window_ + kWindow;
    window.busy += end - spans[first].begin;
    window.work += work;
  }
}

std::vector<SpeedWindow> speed_windows(const TaskSet& set, const Trace& trace, Duration warm_up) {
  SpeedWatch watch(set, trace.epoch, warm_up);
  for (const JobRecord& job : trace.jobs) watch.add(job);
  return std::move(watch).finish();
}

std::optional<double> usual_pace(const std::vector<std::span<const SpeedWindow>>& repetitions) {
  std::vector<double> paces;
  for (const auto& windows : repetitions) {
    for (const SpeedWindow& w : judged_windows(windows)) paces.push_back(pace(w));
  }
  if (paces.empty()) return std::nullopt;
  const auto fast =
      paces.begin() + static_cast<std::ptrdiff_t>(kFastest * static_cast<double>(paces.size() - 1));
  std::nth_element(paces.begin(), fast, paces.end());
  return *fast < kSlowFactor ? *fast : 1;
}

std::vector<SlowPeriod> slow_periods(std::span<const SpeedWindow> windows, double usual) {
  std::vector<SlowPeriod> periods;
  SpeedWindow slow;  // all windows of the last period
  for (const SpeedWindow& w : judged_windows(windows)) {
    if (pace(w) < kSlowFactor * usual) continue;
    if (periods.empty() || slow.cpu != w.cpu || slow.end != w.begin) {
      periods.emplace_back();
      slow = w;
    } else {
      slow.end = w.end;
      slow.busy += w.busy;
      slow.work += w.work;
    }
    periods.back() = {slow.cpu, slow.begin, slow.end, pace(slow) / usual};
  }
  return periods;
}

std::string describe(std::span<const SlowPeriod> slow) {
  constexpr std::size_t kMost = 3;
  std::string sentence;
  for (const SlowPeriod& p : slow.first(std::min(kMost, slow.size()))) {
    sentence += program::text("%sfrom %.1f to %.1f s processor %d was slow by a factor of %.2f",
                              sentence.empty() ? "" : ", ", to_ms(p.begin) / 1e3, to_ms(p.end) / 1e3, p.cpu,
                              p.factor);
  }
  if (slow.size() > kMost) sentence += program::concat(", and ", slow.size() - kMost, " times more");
  return sentence;
}

Duration lost_time(std::span<const SlowPeriod> slow) {
  Duration lost{};
  for (const SlowPeriod& p : slow) lost += from_ms(to_ms(p.end - p.begin) * (1 - 1 / p.factor));
  return lost;
}

Duration slow_time(std::span<const SlowPeriod> slow) {
  std::map<int, Duration> of_cpu;
  Duration longest{};
  for (const SlowPeriod& p : slow) longest = std::max(longest, of_cpu[p.cpu] += p.end - p.begin);
  return longest;
}

}  // namespace hotpath::results
