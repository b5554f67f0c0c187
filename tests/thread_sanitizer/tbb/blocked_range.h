// In place of TBB's header; see parallel_for.h beside it.
#pragma once

namespace tbb {

template <class Value>
class blocked_range {
 public:
  blocked_range(Value begin, Value end, Value grain) : begin_(begin), end_(end), grain_(grain) {}
  Value begin() const { return begin_; }
  Value end() const { return end_; }
  Value grainsize() const { return grain_; }

 private:
  Value begin_, end_, grain_;
};

}  // namespace tbb
