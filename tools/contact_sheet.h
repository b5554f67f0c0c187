// Many pictures at a glance: a sheet of thumbnails, and a page with a slider for each thing that varies.
#pragma once

#include <string>
#include <vector>

#include "nacre/render/image_file.h"
#include "sweep_plan.h"

namespace nacre::tools {

struct SheetPicture {
  std::string file;  // of the preview, beside the page
  std::vector<Setting> settings;
  Preview thumbnail;
};

/// The picture's R, G, B averaged down until no side is above `edge`.
Image shrink(const Image& image, int edge);

/// Thumbnails in rows, as many columns as the last axis has values (about a square where there is one axis or
/// none), each above its settings.
Preview make_contact_sheet(const SweepPlan& plan, const std::vector<SheetPicture>& pictures);

/// A page of HTML that needs nothing beside it: thumbnails with their settings, and a slider for each axis
/// (for the number of the picture, if there is none) that shows one picture; links lead to the previews.
/// "#key=value&key=value" after its address chooses one.
std::string make_sweep_page(const SweepPlan& plan, const std::vector<SheetPicture>& pictures,
                            const std::string& title);

/// "sigma_a* = 0.5".
std::string describe(const Setting& setting);

}  // namespace nacre::tools
