// Uses an installed nacre: data from the optics layer, and files, which need a library behind nacre.
#include <nacre/base/version.h>
#include <nacre/optics/medium.h>
#include <nacre/render/image_file.h>

#include <cstdio>

int main(int, char** arguments) {
  const nacre::Preset* marble = nacre::find_preset("marble");
  if (!marble) return 1;
  const nacre::Image image{1, 1, 0, 0, 1, 1, {{"R", {marble->eta}}}, {}};
  nacre::save_exr(image, arguments[1]);
  const nacre::Image back = nacre::load_exr(arguments[1]);
  std::printf("nacre %s, marble %.2f\n", nacre::kVersion, static_cast<double>(back.channels[0].values[0]));
}
