// What shows a film: previews and a contact sheet, at one exposure.
#include <mutex>
#include <numeric>

#include "contact_sheet.h"
#include "film.h"
#include "nacre/base/file.h"

namespace nacre::tools {
namespace {

constexpr int kThumbnailEdge = 256;
constexpr std::size_t kMostThumbnails = 64;

double lowest_exposure(const std::vector<Picture>& frames) {
  double lowest = 1e3;
  std::mutex mutex;
  parallel_for(frames.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double exposure = auto_exposure(load_exr(frames[i].path));
      const std::lock_guard lock(mutex);
      lowest = std::min(lowest, exposure);
    }
  });
  return lowest;
}

}  // namespace

void show_film(const FilmOptions& options, const FilmPlan& film, const std::vector<Picture>& frames, bool png,
               std::optional<double> exposure, Session& session) {
  if (!png && options.contact_sheet.empty()) return;
  const StageTimer timer(session.report(), "write_image");
  std::vector<int> shown = film.chosen;
  if (!exposure) {
    if (!std::ranges::all_of(frames, is_complete)) {
      session.progress().say("what shows the film at one --exposure auto comes with the last of its frames");
      return;
    }
    exposure = lowest_exposure(frames);
    shown.resize(frames.size());
    std::iota(shown.begin(), shown.end(), film.first);
  }
  // Of many frames the sheet has some, at equal distances.
  const std::size_t step = (shown.size() + kMostThumbnails - 1) / kMostThumbnails;
  std::vector<SheetPicture> sheet((shown.size() + step - 1) / step);
  parallel_for(shown.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Picture& frame = frames[static_cast<std::size_t>(shown[i] - film.first)];
      const Image image = load_exr(frame.path);
      if (png) save_png(image, frame.preview, *exposure);
      if (i % step == 0)
        sheet[i / step] = {frame.preview,
                           {{"frame", fmt::format("{}", shown[i])}},
                           make_preview(shrink(image, kThumbnailEdge), frame.path, *exposure)};
    }
  });
  if (png)
    session.progress().say(fmt::format("{} previews, {} to {}", shown.size(), sheet.front().file,
                                       frames[static_cast<std::size_t>(shown.back() - film.first)].preview));
  if (options.contact_sheet.empty()) return;
  const std::string& path = options.contact_sheet;
  const std::vector<std::uint8_t> bytes = encode_png(make_contact_sheet({}, sheet), path);
  AtomicFile file(path);
  file.write(bytes.data(), bytes.size());
  file.commit();
  session.progress().say(path);
}

}  // namespace nacre::tools
