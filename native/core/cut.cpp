// The algorithm of Boykov and Kolmogorov (2004): a tree grows from the source and one from the sink, over edges with room
// for more flow; where they touch, a path is filled; what that cuts off looks for another parent.
#include "cut.h"

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <limits>
#include <vector>

namespace dd {
namespace {

// The way from a node to its parent: one of the four directions, or
constexpr uint8_t kTerminal = 4, kOrphan = 5, kFree = 6;

// Pixels lie within a margin of nodes that no edge has room to.
class Grid {
 public:
  Grid(int height, int width, const int32_t* gain, const int32_t* right, const int32_t* below)
      : stride_(width + 2), step_{1, -1, stride_, -stride_}, terminal_((height + 2) * stride_), stamp_(terminal_.size()),
        distance_(terminal_.size()), parent_(terminal_.size(), kFree), sinks_(terminal_.size()), active_(terminal_.size()) {
    for (auto& room : room_) room.resize(terminal_.size());
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++) {
        const int at = node(y, x);
        terminal_[at] = gain[y * width + x];
        if (x + 1 < width) room_[0][at] = room_[1][at + 1] = right[y * (width - 1) + x];
        if (y + 1 < height) room_[2][at] = room_[3][at + stride_] = below[y * width + x];
        if (terminal_[at] == 0) continue;
        sinks_[at] = terminal_[at] < 0;
        parent_[at] = kTerminal;
        distance_[at] = 1;
        activate(at);
      }
  }

  void fill() {
    for (int at = -1;;) {
      if (at < 0 || parent_[at] == kFree) at = next_active();
      if (at < 0) return;
      const int way = grow(at);
      time_++;
      if (way < 0) {
        at = -1;
        continue;
      }
      if (sinks_[at]) augment(at + step_[way], way ^ 1);
      else augment(at, way);
      while (!orphans_.empty()) {
        const int orphan = orphans_.front();
        orphans_.pop_front();
        adopt(orphan);
      }
    }
  }

  bool of_source(int y, int x) const { return parent_[node(y, x)] != kFree && !sinks_[node(y, x)]; }

 private:
  int node(int y, int x) const { return (y + 1) * stride_ + x + 1; }

  void activate(int at) {
    if (active_[at]) return;
    active_[at] = true;
    queue_.push_back(at);
  }
  int next_active() {
    while (!queue_.empty()) {
      const int at = queue_.front();
      queue_.pop_front();
      active_[at] = false;
      if (parent_[at] != kFree) return at;
    }
    return -1;
  }

  // Room for flow between a node and its neighbour: away from the source, or towards the sink if the node is the sink's.
  int32_t& outward(int at, int way) { return sinks_[at] ? room_[way ^ 1][at + step_[way]] : room_[way][at]; }
  int32_t& inward(int at, int way) { return sinks_[at] ? room_[way][at] : room_[way ^ 1][at + step_[way]]; }

  void join(int at, int way, int32_t stamp, int32_t distance) {
    parent_[at] = uint8_t(way);
    stamp_[at] = stamp;
    distance_[at] = distance;
  }

  // Takes in the free neighbours; returns the way to a neighbour of the other tree, or -1.
  int grow(int at) {
    for (int way = 0; way < 4; way++) {
      if (!outward(at, way)) continue;
      const int other = at + step_[way];
      if (parent_[other] == kFree) {
        sinks_[other] = sinks_[at];
        join(other, way ^ 1, stamp_[at], distance_[at] + 1);
        activate(other);
      } else if (sinks_[other] != sinks_[at]) {
        return way;
      } else if (stamp_[other] <= stamp_[at] && distance_[other] > distance_[at]) {
        join(other, way ^ 1, stamp_[at], distance_[at] + 1);
      }
    }
    return -1;
  }

  // Fills the path over the edge from a node of the source's tree to one of the sink's.
  void augment(int from, int way) {
    const int ends[2] = {from, from + step_[way]};
    int32_t most = room_[way][from];
    for (int at : ends) {
      for (; parent_[at] != kTerminal; at += step_[parent_[at]]) most = std::min(most, inward(at, parent_[at]));
      most = std::min(most, std::abs(terminal_[at]));
    }
    room_[way][from] -= most;
    room_[way ^ 1][ends[1]] += most;
    for (int at : ends) {
      while (parent_[at] != kTerminal) {
        const int to = parent_[at], next = at + step_[to];
        outward(at, to) += most;
        if (!(inward(at, to) -= most)) cut_off(at, true);
        at = next;
      }
      terminal_[at] -= sinks_[at] ? -most : most;
      if (!terminal_[at]) cut_off(at, true);
    }
  }
  void cut_off(int at, bool first) {
    parent_[at] = kOrphan;
    if (first) orphans_.push_front(at);
    else orphans_.push_back(at);
  }

  // How far a node is from its terminal; the largest number where its path has been cut.
  int32_t distance_of(int at) {
    for (int32_t steps = 0;; steps++) {
      if (stamp_[at] == time_) return steps + distance_[at];
      if (parent_[at] == kOrphan) return kFar;
      if (parent_[at] == kTerminal) {
        stamp_[at] = time_;
        distance_[at] = 1;
        return steps + 1;
      }
      at += step_[parent_[at]];
    }
  }

  // Gives an orphan the neighbour as parent from which its terminal is nearest; without one it is free.
  void adopt(int at) {
    int32_t least = kFar;
    for (int way = 0; way < 4; way++) {
      int other = at + step_[way];
      if (!inward(at, way) || parent_[other] == kFree || sinks_[other] != sinks_[at]) continue;
      int32_t distance = distance_of(other);
      if (distance == kFar) continue;
      if (distance < least) {
        least = distance;
        parent_[at] = uint8_t(way);
      }
      for (; stamp_[other] != time_; other += step_[parent_[other]]) {
        stamp_[other] = time_;
        distance_[other] = distance--;
      }
    }
    if (least < kFar) return join(at, parent_[at], time_, least + 1);
    for (int way = 0; way < 4; way++) {
      const int other = at + step_[way];
      if (parent_[other] == kFree || sinks_[other] != sinks_[at]) continue;
      if (inward(at, way)) activate(other);
      if (parent_[other] == (way ^ 1)) cut_off(other, false);
    }
    parent_[at] = kFree;
  }

  static constexpr int32_t kFar = std::numeric_limits<int32_t>::max();
  const int stride_, step_[4];
  std::vector<int32_t> room_[4], terminal_;     // for more flow, to each neighbour, from the source or (below 0) to the sink
  std::vector<int32_t> stamp_, distance_;       // when a node's distance from its terminal was found, in nodes
  std::vector<uint8_t> parent_, sinks_, active_;
  std::deque<int> queue_, orphans_;
  int32_t time_ = 0;
};

}  // namespace

void minimum_cut(int height, int width, const int32_t* gain, const int32_t* right, const int32_t* below, uint8_t* labelled) {
  Grid grid(height, width, gain, right, below);
  grid.fill();
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) labelled[int64_t(y) * width + x] = grid.of_source(y, x);
}

}  // namespace dd
