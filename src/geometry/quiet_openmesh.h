// OpenMesh reports to a global stream and keeps its readers' state in globals.
#pragma once

#include <OpenMesh/Core/System/omstream.hh>
#include <mutex>

namespace nacre {

/// While it lives, OpenMesh prints nothing and no other thread uses its global state.
class QuietOpenMesh {
 public:
  QuietOpenMesh() : lock_(mutex()) {
    omerr().disable();
    omlog().disable();
  }
  ~QuietOpenMesh() {
    omerr().enable();
    omlog().enable();
  }
  QuietOpenMesh(const QuietOpenMesh&) = delete;
  QuietOpenMesh& operator=(const QuietOpenMesh&) = delete;

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  std::lock_guard<std::mutex> lock_;
};

}  // namespace nacre
