// Keeping evaluated exitance between commands.
#include "nacre/cache/exitance_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <utility>

#include "cache/section_file.h"

namespace nacre {
namespace {

using layout::Kind;

constexpr std::array<unsigned char, 8> kMagic{0x89, 'N', 'C', 'R', 'E', 'X', 0x0d, 0x0a};
constexpr Kind kKey{'E', 'K', 'E', 'Y'}, kFilled{'F', 'I', 'L', 'D'}, kValues{'E', 'X', 'I', 'T'};
constexpr std::array<Kind, 3> kPerGroup{kKey, kFilled, kValues};
constexpr layout::FileKind kExitanceFile{kMagic,
                                         kExitanceVersion,
                                         {},
                                         kPerGroup,
                                         "file of exitance",
                                         "`nacre render --exitance {}` makes one where there is no file",
                                         "delete it, the next render makes a new one"};

// One process at a time extends the files of a folder; where a file system has no locks, the last one wins.
class FolderLock {
 public:
  explicit FolderLock(const std::string& path) {
    std::error_code ignored;
    std::filesystem::path folder = std::filesystem::weakly_canonical(path, ignored).parent_path();
    if (folder.empty()) folder = ".";
    descriptor_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor_ >= 0) ::flock(descriptor_, LOCK_EX);
  }
  ~FolderLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

std::string differences(const KeyValues& kept, const KeyValues& own) {
  std::string text;
  for (std::size_t i = 0; i < std::max(kept.size(), own.size()); ++i) {
    const auto& a = i < kept.size() ? kept[i] : own[i];
    const auto& b = i < own.size() ? own[i] : kept[i];
    if (a == b && i < kept.size() && i < own.size()) continue;
    text += fmt::format("{}{} was {} and is {}", text.empty() ? "" : "; ", b.first,
                        i < kept.size() ? a.second : "absent", i < own.size() ? b.second : "absent");
  }
  return text;
}

}  // namespace

std::vector<KeptExitance> load_exitance(const std::string& path) {
  const layout::SectionReader reader(path, {&kExitanceFile, 1});
  std::vector<KeptExitance> result;
  for (std::uint32_t g = 0; g < reader.group_count(); ++g) {
    KeptExitance& kept = result.emplace_back();
    kept.key = reader.texts(kKey, g);
    const auto filled = reader.array<std::uint8_t>(kFilled, g);
    const auto values = reader.array<Rgb>(kValues, g);
    for (const std::uint8_t f : filled)
      if (f > 1) reader.damaged(kFilled, g, "a mark is neither 0 nor 1");
    for (const Rgb& v : values)
      for (int k = 0; k < 3; ++k)
        if (!(std::isfinite(v[k]) && v[k] >= 0))
          reader.damaged(kValues, g, "a value is negative or not finite");
    kept.filled.assign(filled.begin(), filled.end());
    kept.values.assign(values.begin(), values.end());
  }
  return result;
}

void check_exitance_keys(const std::string& path, const std::vector<KeptExitance>& file,
                         const std::vector<KeptExitance>& own) {
  if (file.size() != own.size())
    fail(ErrorCode::kMismatch, path, "was made for {} media and there are {}; give another file", file.size(),
         own.size());
  for (std::size_t g = 0; g < own.size(); ++g) {
    const std::string difference = differences(file[g].key, own[g].key);
    if (!difference.empty())
      fail(ErrorCode::kMismatch, path, "was made for something else: {}; give another file", difference);
    if (file[g].values.size() != own[g].values.size() || file[g].filled.size() != own[g].filled.size())
      fail(ErrorCode::kMismatch, path, "has {} nodes in {} blocks and there are {} in {}; give another file",
           file[g].values.size(), file[g].filled.size(), own[g].values.size(), own[g].filled.size());
  }
}

void extend_exitance(const std::string& path, std::vector<KeptExitance> exitance,
                     const std::vector<std::vector<std::uint32_t>>& block_of) {
  const FolderLock lock(path);
  if (std::filesystem::exists(path)) {
    const std::vector<KeptExitance> others = load_exitance(path);
    check_exitance_keys(path, others, exitance);
    bool more = false;
    for (std::size_t g = 0; g < exitance.size(); ++g) {
      KeptExitance& own = exitance[g];
      for (std::size_t i = 0; i < own.values.size(); ++i)
        if (!own.filled[block_of[g][i]]) own.values[i] = others[g].values[i];
      for (std::size_t b = 0; b < own.filled.size(); ++b) {
        more = more || own.filled[b] > others[g].filled[b];
        own.filled[b] |= others[g].filled[b];
      }
    }
    if (!more) return;
  }
  std::vector<std::string> keys;
  keys.reserve(exitance.size());
  for (const KeptExitance& own : exitance) keys.push_back(layout::encode_texts(own.key));
  std::vector<layout::Section> sections;
  for (std::size_t g = 0; g < exitance.size(); ++g) {
    const auto index = static_cast<std::uint32_t>(g);
    sections.push_back({kKey, index, keys[g].data(), keys[g].size()});
    sections.push_back({kFilled, index, exitance[g].filled.data(), exitance[g].filled.size()});
    sections.push_back({kValues, index, exitance[g].values.data(), exitance[g].values.size() * sizeof(Rgb)});
  }
  layout::write_sections(path, kExitanceFile, sections, static_cast<std::uint32_t>(exitance.size()));
}

bool is_exitance_file(const std::string& path) { return layout::has_magic(path, kMagic); }

}  // namespace nacre
