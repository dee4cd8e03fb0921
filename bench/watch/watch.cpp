// SPDX-License-Identifier: Apache-2.0
#include "watch/watch.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>
#include <thread>
#include <utility>

#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/output_target.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "watch/contract_check.hpp"
#include "watch/flight_recorder.hpp"
#include "watch/live_view.hpp"
#include "watch/observation_report.hpp"
#include "watch/observer.hpp"
#include "watch/session.hpp"
#include "watch/watched_program.hpp"

namespace hotpath::watch {

namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

constexpr auto kPoll = std::chrono::milliseconds(20);
constexpr seconds kReport{1};
/// From the request to end until the next, stronger one.
constexpr seconds kPatience{5};
constexpr int kNice = 10;
constexpr double kDefaultKeep_s = 10;
constexpr const char* kClearTerminal = "\033[H\033[2J";

std::unique_ptr<ContractCheck> contract_of(const WatchOptions& options) {
  if (options.contract.empty()) return nullptr;
  return std::make_unique<ContractCheck>(read_contract(options.contract), WallClock::now());
}

std::optional<FlightRecorder> recorder_of(const WatchOptions& options) {
  if (options.record.empty()) return std::nullopt;
  program::check_output_folder(options.record, "", "--record");
  program::create_folder(options.record, "--record");
  return FlightRecorder(from_ms(options.keep.value_or(kDefaultKeep_s) * 1000));
}

volatile std::sig_atomic_t snapshot_requested = 0;

class Watch {
 public:
  explicit Watch(const WatchOptions& options)
      : options_(options),
        contract_(contract_of(options)),
        session_(is_attached() ? Meeting::attachable : Meeting::own),
        recorder_(recorder_of(options)),
        observer_(contract_.get(), recorder_ ? &*recorder_ : nullptr,
                  is_attached() ? std::optional(begin_) : std::nullopt) {
    if (!is_attached()) program_ = std::make_unique<WatchedProgram>(options.command, session_.name());
    if (is_refreshed()) view_ = open_live_view();
    setpriority(PRIO_PROCESS, 0, kNice);  // the program has been started with the usual priority
    if (recorder_) std::signal(SIGUSR1, [](int) { snapshot_requested = 1; });
  }

  void run() {
    while (!over()) {
      std::this_thread::sleep_for(kPoll);
      const Time polled = now();
      observe(session_.poll(polled));
      name_programs();
      if (view_) handle(view_->poll_keys());
      if (asked_to_end_ == 0) observer_.observed_until(polled - Session::kSettled, session_.losses());
      judge_threads(polled - Session::kSettled);
      if (elapsed() >= reported_ + kReport) report();
      if (program_) end_program_if_due();
    }
    observe(session_.finish(now()));
    report();
    if (options_.json && options_.once) print_json();
    write_incident();
    const bool had_view = view_ != nullptr;
    view_.reset();
    if (had_view) print_tables();
    print_result();
    const int status = program_ ? *program_->ended() : 0;
    if (asked_to_end_ == 0 && status != 0)
      throw program::RunError("`" + options_.command.front() + "` " + program::how_it_ended(status));
    if (options_.fail_on && contract_->broken())
      throw ContractBroken("the contract " + options_.contract +
                           " is broken: " + contract_->incident(session_.losses()));
  }

 private:
  bool is_attached() const { return options_.command.empty(); }
  bool is_time_over() const {
    if (quit_) return true;
    return options_.seconds && elapsed() >= std::chrono::duration<double>(*options_.seconds);
  }
  bool over() {
    return program_ ? program_->ended().has_value() : is_time_over() || program::interrupted() != 0;
  }

  void handle(ViewAction action) {
    if (action == ViewAction::quit) quit_ = true;
    if (action != ViewAction::snapshot) return;
    if (recorder_) return write_snapshot("requested by a key");
    view_->say("a snapshot needs --record");
  }

  /// Of the programs to which it attaches.
  void name_programs() {
    if (!is_attached()) return;
    for (const std::uint32_t process : session_.found()) {
      if (named_.insert(process).second)
        say(program::concat("attached to process ", process, " (", process_name(process), ")"));
    }
    if (named_.empty() && !std::exchange(waits_, true))
      say("no program runs with the sensor; waiting for one that is started with "
          "env $(hotpath watch --print-environment) PROGRAM");
  }

  static Time now() { return std::chrono::steady_clock::now(); }
  Duration elapsed() const { return now() - begin_; }
  bool is_refreshed() const { return !options_.once && !options_.json && isatty(STDOUT_FILENO) != 0; }

  void observe(const std::vector<tracing::Event>& events) {
    for (const tracing::Event& event : events) observer_.event(event);
    if (contract_ && contract_->settled()) write_incident();
    if (recorder_ && std::exchange(snapshot_requested, 0) != 0) write_snapshot("requested by SIGUSR1");
  }

  /// The facts of threads follow the events that happened before them.
  void judge_threads(Time until) {
    if (contract_ && facts_at_ && *facts_at_ <= until) contract_->threads(facts_, *facts_at_);
    if (facts_at_ && *facts_at_ <= until) facts_at_.reset();
  }

  void write_incident() {
    if (!recorder_ || !contract_ || !contract_->broken() || std::exchange(incident_recorded_, true)) return;
    write_snapshot(contract_->incident(session_.losses()));
  }

  /// A disk that is full does not end the watch.
  void write_snapshot(const std::string& reason) {
    const fs::path folder = fs::path(options_.record) / program::concat("snapshot_", ++snapshots_);
    try {
      recorder_->write(folder);
      say(folder.string() + ": " + reason);
    } catch (const std::exception& error) {
      say(error.what());
    }
  }

  void say(const std::string& sentence) {
    if (view_) return view_->say(sentence);
    std::cerr << "hotpath: " << sentence << std::endl;
  }

  void print_result() const {
    if (!is_refreshed() && !options_.json) print_tables();
    if (contract_ && !options_.json) {
      std::cout << contract_->table(session_.losses());
      if (contract_->broken()) std::cout << "Incident: " << contract_->incident(session_.losses()) << "\n";
    }
    if (session_.threads() == 0 && program_) {
      std::cerr << "hotpath: no tracepoint was recorded: a program without tracetools, of a distribution "
                   "before Jazzy, of another user, or without room in /dev/shm\n";
    }
  }

  void report() {
    reported_ = elapsed();
    judge_threads(Time::max());
    facts_at_ = now();
    facts_ = threads_.read(observer_.system());
    report_.update(observer_, session_, facts_, contract_.get(), reported_);
    observer_.next_interval();
    if (view_) return view_->show(report_, contract_ ? contract_->incident(session_.losses()) : "");
    if (options_.json && !options_.once) print_json();
    if (!is_refreshed()) return;
    program::data_output() << kClearTerminal << std::flush;
    print_tables();
    std::cout << std::flush;
  }

  void print_tables() const {
    for (const program::TextTable& table : report_.tables()) std::cout << table << "\n";
  }

  void print_json() const {
    nlohmann::json line = report_.json();
    if (contract_) line["contract"] = contract_->json(session_.losses());
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
    program_->signal(kRequests[asked_to_end_++]);
    *due_ = elapsed() + kPatience;
  }

  const WatchOptions& options_;
  const Time begin_ = now();
  const std::unique_ptr<ContractCheck> contract_;
  Session session_;  // keeps the texts of the recorder's events
  std::optional<FlightRecorder> recorder_;
  std::unique_ptr<WatchedProgram> program_;  // nullptr: attached
  Observer observer_;
  ThreadReader threads_;
  std::vector<std::optional<ThreadFacts>> facts_;
  std::optional<Time> facts_at_;  // not judged yet
  ObservationReport report_;
  Duration reported_{};
  std::optional<Duration> due_;  // the next request to end
  std::size_t asked_to_end_ = 0;
  std::size_t snapshots_ = 0;
  bool incident_recorded_ = false;
  std::set<std::uint32_t> named_;  // processes
  bool waits_ = false, quit_ = false;
  std::unique_ptr<LiveView> view_;  // nullptr: none
};

}  // namespace

void watch(const WatchOptions& options) {
  if (options.print_environment) {
    program::data_output() << attachable_environment() << std::flush;
    return;
  }
  Watch(options).run();
}

}  // namespace hotpath::watch
