// SPDX-License-Identifier: Apache-2.0
#include "watch/watch.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <deque>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <thread>
#include <utility>

#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/forked_task.hpp"
#include "program/interrupt.hpp"
#include "program/output_target.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "watch/chain_explanation.hpp"
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
/// Between two readings of policies, processors and waits: long for many threads. Few are read often,
/// because a wait explains only what happened between two readings.
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

std::unique_ptr<ContractCheck> contract_of(const WatchOptions& options) {
  if (options.contract.empty()) return nullptr;
  return std::make_unique<ContractCheck>(read_contract(options.contract), WallClock::now());
}

/// `explains`: the screen explains chains from the last events.
std::optional<FlightRecorder> recorder_of(const WatchOptions& options, bool explains) {
  if (options.record.empty() && !explains) return std::nullopt;
  return FlightRecorder(from_ms(options.keep.value_or(kDefaultKeep_s) * 1000));
}

volatile std::sig_atomic_t snapshot_requested = 0;

/// Whether snapshots are written.
bool prepare_record(const WatchOptions& options) {
  if (options.record.empty()) return false;
  program::check_output_folder(options.record, "", "--record");
  program::create_folder(options.record, "--record");
  std::signal(SIGUSR1, [](int) { snapshot_requested = 1; });
  return true;
}

std::unique_ptr<WatchedProgram> program_of(const WatchOptions& options, const std::string& session) {
  return options.command.empty() ? nullptr : std::make_unique<WatchedProgram>(options.command, session);
}

class Watch {
 public:
  explicit Watch(const WatchOptions& options)
      : options_(options),
        contract_(contract_of(options)),
        session_(is_attached() ? Meeting::attachable : Meeting::own),
        records_(prepare_record(options)),
        program_(program_of(options, session_.name())),
        view_(is_refreshed() ? open_live_view() : nullptr),
        recorder_(recorder_of(options, view_ && contract_)),
        observer_(contract_.get(), recorder_ ? &*recorder_ : nullptr,
                  is_attached() ? std::optional(begin_) : std::nullopt) {
    setpriority(PRIO_PROCESS, 0, kNice);  // the program has been started with the usual priority
    observer_.set_realtime(WallClock::now().offset());
  }

  void run() {
    while (!over()) {
      std::this_thread::sleep_for(kPoll);
      const Time polled = now();
      observe(session_.poll(polled));
      name_programs();
      if (view_) handle(view_->poll_keys());
      if (writer_ && writer_->result()) end_snapshot();
      if (!is_ending()) observer_.observed_until(polled - Session::kSettled, session_.losses());
      judge_threads(polled - Session::kSettled);
      if (now() >= next_reading_) read_threads();
      state_incidents(false);
      if (elapsed() >= reported_ + kReport) report();
      if (program_) end_program_if_due();
    }
    observe(session_.finish(now()));
    read_threads();
    judge_threads(Time::max());
    state_incidents(true);
    report();
    if (options_.json && options_.once) print_json();
    const bool had_view = view_ != nullptr;
    view_.reset();
    while (writer_) end_snapshot();
    if (had_view) print_tables();
    print_result();
    const int status = program_ ? *program_->ended() : 0;
    if (!is_ending() && status != 0)
      throw program::RunError("`" + options_.command.front() + "` " + program::how_it_ended(status));
    if (options_.fail_on && observer_.events() == 0)
      throw program::RunError("nothing was observed, so the contract " + options_.contract +
                              " could not be judged");
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

  /// Whether the program was asked to end. A terminal sends an interrupt to the program as well.
  bool is_ending() const { return due_ || program::interrupted() != 0; }

  void handle(ViewAction action) {
    if (action == ViewAction::quit) quit_ = true;
    if (action == ViewAction::explain) start_explanation();
    if (const auto lines = explanation_ ? explanation_->lines() : std::nullopt) {
      view_->explain(explained_, *lines);
      explanation_.reset();
    }
    if (action != ViewAction::snapshot) return;
    if (records_) {
      write_snapshot("requested by a key");
    } else {
      view_->say("a snapshot needs --record");
    }
  }

  void start_explanation() {
    explained_ = view_->chain();
    try {
      explanation_.reset();
      explanation_ = std::make_unique<ChainExplanation>(*recorder_, contract_->imported_chain(explained_));
      view_->explain(explained_, {"explaining " + explained_ + " ..."});
    } catch (const std::exception& error) {
      say(error.what());
    }
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
    if (contract_) contract_->note_losses(session_.losses().total(), now());
    if (contract_ && program_ && is_ending()) contract_->end();
    for (const tracing::Event& event : events) observer_.event(event);
    if (records_ && std::exchange(snapshot_requested, 0) != 0) write_snapshot("requested by SIGUSR1");
  }

  void read_threads() {
    const ThreadReading& reading = unjudged_.emplace_back(threads_.read(observer_.system(), now()));
    report_.follow(reading);
    const WallClock clock = WallClock::now();
    observer_.set_realtime(clock.offset());
    next_reading_ = reading.at + kFacts;
    if (!contract_) return;  // no wait is to be explained
    contract_->follow(clock, reading.at);
    const auto of_each = kFactsOfEach * static_cast<int>(reading.facts.size());
    next_reading_ = std::min(next_reading_, reading.at + of_each);
  }

  /// The facts of threads follow the events that happened before them.
  void judge_threads(Time until) {
    for (; !unjudged_.empty() && unjudged_.front().at <= until; unjudged_.pop_front()) {
      const ThreadReading& reading = unjudged_.front();
      if (contract_) contract_->threads(reading.facts, reading.at);
      for (const ThreadKey& thread : reading.ended) observer_.forget(thread);
    }
  }

  /// States new incidents, and those that are known better, as soon as their causes are known.
  void state_incidents(bool at_end) {
    if (!contract_) return;
    for (const Incident& incident : contract_->incidents().kept()) {
      const auto stated = stated_.find(incident.number());
      const bool is_new = stated == stated_.end();
      if (!is_new && stated->second == incident.changes()) continue;
      if (!at_end && !contract_->settled(incident)) continue;
      stated_[incident.number()] = incident.changes();
      const std::string text = contract_->text(incident, session_.losses());
      nlohmann::json line = contract_->json(incident, text);
      if (is_new && records_ && incident.number() <= kMostIncidentSnapshots) {
        recorder_->mark(incident.begin().at, text);
        if (const fs::path folder = write_snapshot(text); !folder.empty()) line["snapshot"] = folder.string();
      }
      line["event"] = "incident";
      line["time_s"] = to_ms(elapsed()) / 1000;
      if (options_.json && !options_.once) print_line(line);
    }
    std::erase_if(stated_, [&](const auto& stated) {  // which are no longer kept
      return stated.first > 1 && stated.first + Incidents::kMost <= contract_->incidents().count();
    });
  }

  /// Writes it now, or as soon as the one that is being written is complete: requests until then share
  /// it. Returns its folder; empty: it cannot begin.
  fs::path write_snapshot(const std::string& reason) {
    if (snapshots_.size() > 1) {
      snapshots_.back().reason += "; " + reason;
      return snapshots_.back().folder;
    }
    fs::path folder = fs::path(options_.record) / program::concat("snapshot_", ++last_snapshot_);
    snapshots_.push_back({folder, reason});
    return writer_ || begin_snapshot() ? folder : fs::path();
  }

  /// In a process of its own, because rings hold events for less than a second.
  bool begin_snapshot() {
    try {
      writer_.emplace([&] { recorder_->write(snapshots_.front().folder); });
    } catch (const std::exception& error) {
      say(error.what());
      snapshots_.pop_front();
    }
    return writer_.has_value();
  }

  /// A disk that is full does not end the watch.
  void end_snapshot() {
    const auto& [folder, reason] = snapshots_.front();
    const std::string error = writer_->wait();
    say(error.empty() ? folder.string() + ": " + reason : error);
    writer_.reset();
    snapshots_.pop_front();
    if (!snapshots_.empty()) begin_snapshot();
  }

  void say(const std::string& sentence) {
    if (view_) return view_->say(sentence);
    std::cerr << "hotpath: " << sentence << std::endl;
  }

  void print_result() const {
    if (!is_refreshed() && !options_.json) print_tables();
    if (contract_ && !options_.json) {
      std::cout << contract_->table(session_.losses());
      const std::deque<Incident>& incidents = contract_->incidents().kept();
      for (std::size_t i = 0; i < std::min(incidents.size(), kMostPrinted); ++i)
        std::cout << "Incident: " << contract_->text(incidents[i], session_.losses()) << "\n";
      if (const std::uint64_t count = contract_->incidents().count(); count > kMostPrinted)
        std::cout << count - kMostPrinted << " further incidents\n";
    }
    if (session_.threads() == 0 && program_) {
      std::cerr << "hotpath: no tracepoint was recorded: a program without tracetools, of a distribution "
                   "before Humble, of another user, or without room in /dev/shm\n";
    }
  }

  void report() {
    reported_ = elapsed();
    report_.update(observer_, session_, contract_.get(), reported_);
    if (view_) return view_->show(report_, latest_incident());
    if (options_.json && !options_.once) print_json();
    if (!is_refreshed()) return;
    program::data_output() << kClearTerminal << std::flush;
    print_tables();
    std::cout << std::flush;
  }

  std::string latest_incident() const {
    if (!contract_ || !contract_->broken()) return "";
    return contract_->text(contract_->incidents().kept().back(), session_.losses());
  }

  void print_tables() const {
    for (const program::TextTable& table : report_.tables()) std::cout << table << "\n";
  }

  void print_json() const {
    nlohmann::json line = report_.json();
    if (contract_) line["contract"] = contract_->json(session_.losses());
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
    program_->signal(kRequests[asked_to_end_++]);
    *due_ = elapsed() + kPatience;
  }

  struct Snapshot {
    fs::path folder;
    std::string reason;
  };

  const WatchOptions& options_;
  const Time begin_ = now();
  const std::unique_ptr<ContractCheck> contract_;
  Session session_;  // keeps the texts of the recorder's events
  const bool records_;
  const std::unique_ptr<WatchedProgram> program_;  // nullptr: attached
  std::unique_ptr<LiveView> view_;                 // nullptr: none
  std::optional<FlightRecorder> recorder_;
  Observer observer_;
  ThreadReader threads_;
  std::deque<ThreadReading> unjudged_;
  ObservationReport report_{options_.once};
  Duration reported_{};
  Time next_reading_{};
  std::optional<Duration> due_;  // the next request to end
  std::size_t asked_to_end_ = 0;
  std::deque<Snapshot> snapshots_;  // the one that is being written, and the one that is asked for meanwhile
  std::optional<program::ForkedTask> writer_;
  std::size_t last_snapshot_ = 0;                  // its number
  std::map<std::uint64_t, std::uint64_t> stated_;  // incidents, and their changes until then
  std::set<std::uint32_t> named_;                  // processes
  bool waits_ = false, quit_ = false;
  std::unique_ptr<ChainExplanation> explanation_;  // that was asked for
  std::string explained_;                          // its chain
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
