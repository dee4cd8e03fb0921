// SPDX-License-Identifier: Apache-2.0
#include "watch/watch.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "hotpath/sensor/ring.hpp"
#include "machine/proc_files.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/output_target.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "watch/observation_report.hpp"
#include "watch/session.hpp"

namespace hotpath::watch {

namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

constexpr auto kPoll = std::chrono::milliseconds(20);
constexpr seconds kReport{1};
/// Between two readings of policies, processors and waits: long for many threads.
constexpr auto kFacts = std::chrono::milliseconds(200), kFactsOfEach = std::chrono::milliseconds(2);
/// Further ones are not written, so that they do not fill the disk.
constexpr std::size_t kMostIncidentSnapshots = 20;
/// That are printed at the end.
constexpr std::size_t kMostPrinted = 20;
/// From the request to end until the next, stronger one.
constexpr seconds kPatience{5};
constexpr int kNice = 10;
constexpr double kDefaultKeep_s = 10;
constexpr const char* kClearTerminal = "\033[H\033[2J";

volatile std::sig_atomic_t snapshot_requested = 0;

/// The real-time clock minus that of Time, at this moment. A pause between two readings is no step.
Duration realtime_now() {
  using namespace std::chrono;
  constexpr milliseconds kPause{5};
  for (;;) {
    const auto before = steady_clock::now();
    const auto real = system_clock::now().time_since_epoch();
    if (steady_clock::now() - before < kPause) return real - before.time_since_epoch();
  }
}

std::unique_ptr<FlightRecorder> recorder_of(const WatchOptions& options) {
  if (options.record.empty()) return nullptr;
  program::check_output_folder(options.record, "", "--output");
  program::create_folder(options.record, "--output");
  std::signal(SIGUSR1, [](int) { snapshot_requested = 1; });
  return std::make_unique<FlightRecorder>(from_s(options.keep.value_or(kDefaultKeep_s)));
}

/// Beside the installed command, or in the build tree.
std::string sensor_library() {
  const fs::path installed =
      fs::path(program::own_program()).parent_path().parent_path() / "lib" / "libhotpath_watch.so";
  std::string library = fs::exists(installed) ? installed.string() : HOTPATH_SENSOR;
  if (!fs::exists(library))
    throw program::RunError("the sensor " + library + " does not exist; install the package hotpath_sensor");
  if (library.find_first_of(" :") != std::string::npos)
    throw program::RunError("the sensor cannot be preloaded, because its path has a blank or colon: " +
                            library);
  return library;
}

/// The variables with which programs run with the sensor, and their values. Other preloaded libraries stay.
/// Throws RunError.
std::vector<std::pair<std::string, std::string>> sensor_variables(const std::string& session) {
  const char* const others = std::getenv("LD_PRELOAD");
  std::string rest = others == nullptr || *others == '\0' ? "" : ":" + std::string(others);
  std::ranges::replace(rest, ' ', ':');  // a shell splits `env $(...)` at blanks
  return {{"LD_PRELOAD", sensor_library() + rest}, {sensor::kSessionVariable, session}};
}

/// Starts the program, found along PATH, with its arguments and the sensor; it keeps running if the watcher
/// is killed. Its standard output goes to standard error, because the watcher writes to standard output.
/// Throws RunError if it cannot be started.
pid_t start(const std::vector<std::string>& command, const std::string& session) {
  for (const auto& [name, value] : sensor_variables(session)) setenv(name.c_str(), value.c_str(), 1);
  const auto prepare = [] {
    std::signal(SIGPIPE, SIG_DFL);  // this program ignores both
    std::signal(SIGXFSZ, SIG_DFL);
    umask(program::inherited_umask);
    dup2(STDERR_FILENO, STDOUT_FILENO);
  };
  return program::start_program(command, prepare, environ);
}

class Watch {
 public:
  explicit Watch(const WatchOptions& options)
      : options_(options),
        given_(options.contract.empty() ? Contract{} : read_contract(options.contract)),
        session_(is_attached()),
        recorder_(recorder_of(options)),
        observer_(given_, recorder_.get(), realtime_now(),
                  is_attached() ? std::optional(begin_) : std::nullopt) {
    if (!is_attached()) program_ = start(options.command, session_.name());
    setpriority(PRIO_PROCESS, 0, kNice);  // the program has been started with the usual priority
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  /// Kills the program if it still runs.
  ~Watch() {
    if (is_attached() || ended()) return;
    kill(program_, SIGKILL);
    int status = 0;
    program::await_process(program_, &status);
  }

  void run() {
    while (!over()) {
      std::this_thread::sleep_for(kPoll);
      const Time polled = now();
      observe(session_.poll(polled));
      name_programs();
      end_snapshots(false);
      if (!is_ending()) observer_.observed_until(polled - Session::kSettled, losses());
      judge_threads(polled - Session::kSettled);
      if (now() >= next_reading_) read_threads();
      state_incidents(false);
      if (elapsed() >= reported_ + kReport) report();
      if (!is_attached()) end_program_if_due();
    }
    observe(session_.finish(now()));
    if (!is_attached()) observer_.end();
    read_threads();
    judge_threads(Time::max());
    state_incidents(true);
    report();
    if (options_.json && options_.once) print_json();
    end_snapshots(true);
    print_result();
    const int status = is_attached() ? 0 : *ended();
    if (!is_ending() && status != 0)
      throw program::RunError("`" + options_.command.front() + "` " + program::how_it_ended(status));
    if (options_.fail_on && observer_.events() == 0)
      throw program::RunError("nothing was observed, so the contract " + options_.contract +
                              " could not be judged");
    if (options_.fail_on && !observer_.judge().incident().empty())
      throw program::ContractBroken("the contract " + options_.contract +
                                    " is broken: " + observer_.judge().incident());
  }

 private:
  bool is_judged() const { return !options_.contract.empty(); }
  bool is_attached() const { return options_.command.empty(); }
  bool is_refreshed() const { return !options_.once && !options_.json && isatty(STDOUT_FILENO) != 0; }
  std::deque<Incident>& incidents() { return observer_.judge().incidents().kept; }
  std::uint64_t losses() const { return session_.losses().total(); }
  static Time now() { return std::chrono::steady_clock::now(); }
  Duration elapsed() const { return now() - begin_; }
  bool is_time_over() const {
    return options_.seconds && elapsed() >= std::chrono::duration<double>(*options_.seconds);
  }
  /// The status of the program as from waitpid(), once it has ended; the first call after the end waits for
  /// it.
  std::optional<int> ended() {
    int status = 0;
    if (!status_ && program::await_process(program_, &status, WNOHANG) == program_) status_ = status;
    return status_;
  }
  bool over() { return is_attached() ? is_time_over() || program::interrupted() != 0 : ended().has_value(); }
  /// Whether the program was asked to end. A terminal sends an interrupt to the program as well.
  bool is_ending() const { return due_ || program::interrupted() != 0; }

  /// Of the programs to which it attaches.
  void name_programs() {
    if (!is_attached()) return;
    for (const std::uint32_t process : session_.found()) {
      if (named_.insert(process).second)
        say(program::concat("attached to process ", process, " (",
                            machine::first_line(program::concat("/proc/", process, "/comm")), ")"));
    }
    if (named_.empty() && !std::exchange(waits_, true))
      say("no program runs with the sensor; waiting for one that is started with "
          "env $(hotpath watch --print-environment) PROGRAM");
  }

  void observe(const std::vector<tracing::Event>& events) {
    observer_.note_losses(losses(), now());
    if (!is_attached() && is_ending()) observer_.end();
    for (const tracing::Event& event : events) observer_.event(event);
    if (recorder_ && writers_.empty() && std::exchange(snapshot_requested, 0) != 0)
      write_snapshot("requested by SIGUSR1");
  }

  void read_threads() {
    const ThreadReading& reading = unjudged_.emplace_back(threads_.read(observer_.system(), now()));
    report_.follow(reading, observer_);
    observer_.set_realtime(realtime_now(), reading.at);
    const auto of_each = kFactsOfEach * static_cast<int>(reading.facts.size());
    next_reading_ = reading.at + (is_judged() ? std::min(kFacts, of_each) : kFacts);
  }

  /// The facts of threads follow the events that happened before them.
  void judge_threads(Time until) {
    for (; !unjudged_.empty() && unjudged_.front().at <= until; unjudged_.pop_front()) {
      const ThreadReading& reading = unjudged_.front();
      observer_.threads(reading.facts, reading.at);
      for (const ThreadKey& thread : reading.ended)
        observer_.forget(thread, session_.broke_off(thread.first));
    }
  }

  void state_incidents(bool at_end) {
    for (const Incident* const incident : observer_.describe(at_end)) {
      nlohmann::json line = incident->json();
      if (incident->number() > stated_ && recorder_ && incident->number() <= kMostIncidentSnapshots) {
        recorder_->mark(incident->first().at, incident->text());
        const std::string folder = write_snapshot(incident->text());
        if (!folder.empty()) line["snapshot"] = folder;
      }
      stated_ = std::max(stated_, incident->number());
      line["event"] = "incident";
      line["time_s"] = to_s(elapsed());
      if (options_.json && !options_.once) print_line(line);
    }
  }

  /// Begins to write it in a process of its own, because rings hold events for less than a second. Returns
  /// its folder; empty: it cannot begin.
  std::string write_snapshot(const std::string& reason) {
    std::string folder = fs::path(options_.record) / program::concat("snapshot_", ++snapshots_);
    try {
      writers_.try_emplace(folder + ": " + reason, [&] { recorder_->write(folder); });
      return folder;
    } catch (const std::exception& error) {
      say(error.what());
      return "";
    }
  }

  /// Says which snapshots are complete; `wait`: completes all. A disk that is full does not end the watch.
  void end_snapshots(bool wait) {
    for (auto writer = writers_.begin(); writer != writers_.end();) {
      auto& [sentence, task] = *writer;
      if (wait || task.result()) {
        say(task.wait().empty() ? sentence : task.wait());
        writer = writers_.erase(writer);
      } else {
        ++writer;
      }
    }
  }

  static void say(const std::string& sentence) { std::cerr << "hotpath: " << sentence << std::endl; }

  void print_result() {
    if (!is_refreshed() && !options_.json) print_tables();
    if (is_judged() && !options_.json) {
      std::cout << observer_.judge().table(losses() > 0);
      std::vector<Incident> listed(incidents().begin(), incidents().end());
      std::ranges::stable_sort(listed, {}, &Incident::severity);
      for (std::size_t i = 0; i < std::min(listed.size(), kMostPrinted); ++i) print_incident(listed[i]);
      if (listed.size() > kMostPrinted)
        std::cout << incidents().back().number() - kMostPrinted << " further incidents\n";
    }
    if (session_.threads() == 0 && !is_attached())
      say("no tracepoint was recorded: a program without tracetools, of a distribution before Humble, of "
          "another user, or without room in /dev/shm");
  }

  void report() {
    reported_ = elapsed();
    report_.update(observer_, session_, reported_);
    if (options_.json && !options_.once) print_json();
    if (!is_refreshed()) return;
    program::data_output() << kClearTerminal << std::flush;
    print_tables();
    if (!incidents().empty()) print_incident(incidents().back());
    std::cout << std::flush;
  }

  void print_incident(const Incident& incident) const {
    std::cout << "Incident: " << incident.text() << "\n";
    for (const std::string& fact : incident.facts()) std::cout << "  " << fact << "\n";
  }

  void print_tables() const {
    for (const program::Table& table : report_.tables()) std::cout << table << "\n";
  }

  void print_json() {
    nlohmann::json line = report_.json();
    if (is_judged()) line["contract"] = observer_.judge().json(losses() > 0);
    print_line(line);
  }

  static void print_line(const nlohmann::json& line) {
    program::data_output() << line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)
                           << std::endl;
  }

  /// Asks the program to end after the given time or an interrupt; the longer it takes, the more
  /// forcefully. A terminal sends Ctrl-C to the program as well, and a second SIGINT might cut its
  /// orderly end short.
  void end_program_if_due() {
    constexpr int kRequests[] = {SIGINT, SIGTERM, SIGKILL};
    if (!due_) {
      const bool over = is_time_over();
      if (!over && program::interrupted() == 0) return;
      due_ = elapsed() + (over ? seconds(0) : seconds(1));
    }
    if (elapsed() < *due_ || asked_to_end_ == std::size(kRequests)) return;
    if (!status_) kill(program_, kRequests[asked_to_end_]);
    ++asked_to_end_;
    *due_ = elapsed() + kPatience;
  }

  const WatchOptions& options_;
  const Time begin_ = now();
  const Contract given_;
  Session session_;                                 // keeps the texts of the recorder's events
  const std::unique_ptr<FlightRecorder> recorder_;  // nullptr: no snapshots are written
  Observer observer_;
  pid_t program_ = -1;         // none if attached
  std::optional<int> status_;  // of the program, after its end
  ThreadReader threads_;
  std::deque<ThreadReading> unjudged_;
  ObservationReport report_{options_.once};
  Duration reported_{};
  Time next_reading_{};
  std::optional<Duration> due_;  // the next request to end
  std::size_t asked_to_end_ = 0;
  std::map<std::string, program::ForkedTask> writers_;  // of snapshots, by the sentence that reports one
  std::size_t snapshots_ = 0;
  std::uint64_t stated_ = 0;       // incidents
  std::set<std::uint32_t> named_;  // processes
  bool waits_ = false;
};

}  // namespace

void watch(const WatchOptions& options) {
  if (options.print_environment) {
    for (const auto& [name, value] : sensor_variables(sensor::kAttachable))
      program::data_output() << name << "=" << value << "\n";
    program::data_output() << std::flush;
    return;
  }
  Watch(options).run();
}

}  // namespace hotpath::watch
