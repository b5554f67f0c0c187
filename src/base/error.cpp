// The exception's text.
#include "nacre/base/error.h"

namespace nacre {

Error::Error(ErrorCode error_code, std::string error_place, std::string error_reason)
    : code_(error_code),
      place_(std::move(error_place)),
      reason_(std::move(error_reason)),
      text_(place_.empty() ? reason_ : place_ + ": " + reason_) {}

}  // namespace nacre
