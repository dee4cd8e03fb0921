// SPDX-License-Identifier: Apache-2.0
#include "program/forked_task.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <tuple>

#include "program/child_process.hpp"
#include "program/errors.hpp"

namespace hotpath::program {

ForkedTask::ForkedTask(const std::function<void()>& task) : error_(memfd_create("error", MFD_CLOEXEC)) {
  const pid_t parent = getpid();
  id_ = error_ < 0 ? -1 : fork();
  if (id_ < 0) {
    const std::string cause = std::strerror(errno);
    close(error_);
    throw RunError("no process could be created: " + cause);
  }
  if (id_ > 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  setpgid(0, 0);  // the terminal's signals are for the parent
  std::string error;
  try {
    task();
  } catch (const std::exception& e) {
    error = e.what();
  }
  std::ignore = write(error_, error.data(), error.size());
  _exit(0);  // without destructors: what they end belongs to the parent
}

ForkedTask::~ForkedTask() {
  if (!result_) {
    kill(-id_, SIGKILL);
    kill(id_, SIGKILL);  // before it has a group of its own
    await_process(id_, nullptr);
  }
  close(error_);
}

const std::optional<std::string>& ForkedTask::end(bool wait) {
  int status = 0;
  if (result_) return result_;
  const pid_t ended = await_process(id_, &status, wait ? 0 : WNOHANG);
  if (ended == 0) return result_;
  std::array<char, 4096> text;
  const ssize_t length = pread(error_, text.data(), text.size(), 0);
  result_.emplace(text.data(), static_cast<std::size_t>(std::max<ssize_t>(length, 0)));
  if (result_->empty() && ended < 0)  // SIGCHLD is ignored
    result_ = "the process has ended, but how is unknown";
  if (result_->empty() && !exited_with(status, 0)) result_ = "the process " + how_it_ended(status);
  return result_;
}

}  // namespace hotpath::program
