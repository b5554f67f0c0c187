// What shows a film: previews and a contact sheet, at one exposure.
#include <mutex>

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

// Of frames at equal distances, where there are many.
void save_contact_sheet(const std::string& path, const FilmPlan& film, const std::vector<Picture>& frames,
                        double exposure) {
  const std::size_t step = (frames.size() + kMostThumbnails - 1) / kMostThumbnails;
  std::vector<SheetPicture> pictures((frames.size() + step - 1) / step);
  parallel_for(pictures.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      pictures[i] = {frames[i * step].preview,
                     {{"frame", fmt::format("{}", film.first + static_cast<int>(i * step))}},
                     make_preview(shrink(load_exr(frames[i * step].path), kThumbnailEdge), path, exposure)};
  });
  const std::vector<std::uint8_t> bytes = encode_png(make_contact_sheet({}, pictures), path);
  AtomicFile file(path);
  file.write(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace

void show_film(const FilmOptions& options, const FilmPlan& film, const std::vector<Picture>& frames, bool png,
               std::optional<double> exposure, Session& session) {
  const bool sheet = !options.contact_sheet.empty();
  if (!png && !sheet) return;
  const StageTimer timer(session.report(), "write_image");
  std::vector<const Picture*> shown;
  if (exposure)
    for (const int frame : film.chosen)
      shown.push_back(&frames[static_cast<std::size_t>(frame - film.first)]);
  else
    for (const Picture& frame : frames) shown.push_back(&frame);
  const bool whole = (exposure && !sheet) || std::ranges::all_of(frames, is_complete);
  if (whole && !exposure) exposure = lowest_exposure(frames);
  if (png && exposure) {
    parallel_for(shown.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        save_png(load_exr(shown[i]->path), shown[i]->preview, *exposure);
    });
    session.progress().say(
        fmt::format("{} previews, {} to {}", shown.size(), shown.front()->preview, shown.back()->preview));
  }
  if (!whole) {
    session.progress().say(fmt::format("{} to come once all frames of the film are there",
                                       exposure ? "the contact sheet is"
                                       : sheet  ? "previews and the contact sheet are"
                                                : "previews are"));
    return;
  }
  if (!sheet) return;
  save_contact_sheet(options.contact_sheet, film, frames, *exposure);
  session.progress().say(options.contact_sheet);
}

}  // namespace nacre::tools
