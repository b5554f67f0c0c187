// Running the program as a user does, in a folder of its own.
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace nacre::testing_support {

/// A temporary folder that is gone after the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "nacre-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path path() const { return path_; }
  std::string file(const std::string& name) const { return (path_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return file(name);
  }
  std::size_t count() const {
    std::size_t n = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(path_)) ++n;
    return n;
  }

 private:
  std::filesystem::path path_;
};

struct ProgramResult {
  int exit_code;
  std::string output;  // standard output and error together
  /// Lines of the output.
  int lines() const {
    int n = 0;
    for (const char c : output) n += c == '\n';
    return n;
  }
};

/// A command of the shell, in `folder`.
inline ProgramResult run_shell(const TemporaryFolder& folder, const std::string& shell_command) {
  const std::string command = "cd '" + folder.path().string() + "' && " + shell_command + " 2>&1 < /dev/null";
  ProgramResult result{-1, ""};
  FILE* pipe = ::popen(command.c_str(), "r");
  if (!pipe) return result;
  std::array<char, 4096> buffer;
  while (const std::size_t got = std::fread(buffer.data(), 1, buffer.size(), pipe))
    result.output.append(buffer.data(), got);
  const int status = ::pclose(pipe);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

/// `nacre ARGUMENTS` by the shell, in `folder`.
inline ProgramResult run_nacre(const TemporaryFolder& folder, const std::string& arguments) {
  return run_shell(folder, "'" NACRE_PROGRAM "' " + arguments);
}

inline std::string read_file(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// A small scene: a translucent sphere on a floor under two lights. $sigma_a and $light_x may be set from
/// outside.
inline const char* const kSmallScene = R"(<scene version="0.6.0">
  <default name="sigma_a" value="0.01"/>
  <default name="light_x" value="20"/>
  <integrator type="direct"><integer name="emitterSamples" value="2"/></integrator>
  <sensor type="perspective" id="main">
    <float name="fov" value="35"/>
    <transform name="toWorld"><lookat origin="0, 12, 40" target="0, 5, 0" up="0, 1, 0"/></transform>
    <sampler type="independent"><integer name="sampleCount" value="4"/></sampler>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film>
  </sensor>
  <sensor type="perspective" id="other">
    <transform name="toWorld"><lookat origin="30, 12, 20" target="0, 5, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film>
  </sensor>
  <shape type="sphere" id="ball">
    <point name="center" x="0" y="5" z="0"/>
    <float name="radius" value="5"/>
    <subsurface type="dipole" id="wax">
      <rgb name="sigmaS" value="3, 2.5, 2"/>
      <rgb name="sigmaA" value="$sigma_a, 0.02, 0.03"/>
      <float name="scale" value="1"/>
    </subsurface>
  </shape>
  <shape type="rectangle" id="floor">
    <transform name="toWorld"><scale value="60"/><rotate x="1" angle="-90"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.4, 0.4, 0.4"/></bsdf>
  </shape>
  <emitter type="point" id="spark">
    <point name="position" x="$light_x" y="30" z="10"/>
    <rgb name="intensity" value="2000, 2000, 1800"/>
  </emitter>
  <shape type="rectangle" id="panel">
    <transform name="toWorld"><scale value="5"/><lookat origin="-15, 25, -15" target="0, 5, 0" up="0, 1, 0"/></transform>
    <emitter type="area" id="panel light"><rgb name="radiance" value="8, 8, 9"/></emitter>
  </shape>
</scene>
)";

}  // namespace nacre::testing_support
