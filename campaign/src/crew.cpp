// SPDX-License-Identifier: Apache-2.0
#include "hotpath/campaign/crew.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <thread>

#include "message.hpp"
#include "roles.hpp"

namespace hotpath {

Crew::Crew(const CrewOptions& options) : options_(options), link_(make_mpi_link()) {
  if (options_.threads == 0) options_.threads = std::max(1U, std::thread::hardware_concurrency());
}

Crew::~Crew() {
  if (ran_ || !link_) return;
  if (link_->rank() != 0) {
    link_->send(0, pack({.kind = Message::Kind::bye}));
    return;
  }
  try {
    coordinate({}, options_, link_.get());  // an empty campaign, because the others wait for the end
  } catch (const CampaignError&) {          // a rank sent an invalid message; all ranks end anyway
  }
}

bool Crew::coordinates() const { return !link_ || link_->rank() == 0; }
unsigned Crew::ranks() const { return link_ ? link_->ranks() : 1; }
unsigned Crew::ranks_on_this_machine() const { return link_ ? link_->ranks_on_this_machine() : 1; }

std::vector<std::string> Crew::run(const Campaign& campaign) {
  ran_ = true;
  if (coordinates()) return coordinate(campaign, options_, link_.get());
  work_for_coordinator(campaign, options_, *link_);
  return {};
}

std::uint64_t hash_of(std::string_view bytes, std::uint64_t so_far) {
  for (const char byte : bytes) so_far = (so_far ^ static_cast<unsigned char>(byte)) * 0x100000001b3;
  return so_far;
}

std::uint64_t build_fingerprint() {
  static const std::uint64_t fingerprint = [] {
    std::ifstream program("/proc/self/exe", std::ios::binary);
    std::uint64_t hash = hash_of({});
    std::array<char, 65536> block;
    while (program.read(block.data(), block.size()) || program.gcount() > 0) {
      hash = hash_of({block.data(), static_cast<std::size_t>(program.gcount())}, hash);
    }
    return hash;
  }();
  return fingerprint;
}

std::uint64_t identity(const Campaign& campaign) { return hash_of(campaign.name, build_fingerprint()); }

#ifndef HOTPATH_WITH_MPI
std::unique_ptr<Link> make_mpi_link() { return nullptr; }
#endif

}  // namespace hotpath
