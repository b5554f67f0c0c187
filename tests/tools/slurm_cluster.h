// A Slurm cluster of two nodes on the loopback address, with its own munge: for one test, and gone after it.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <thread>

#include "tools/cli.h"

namespace nacre::testing_support {

/// Whether `condition` comes true in time.
inline bool wait_until(const std::function<bool()>& condition, double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return true;
}

/// What a shell command prints.
inline std::string read_command(const std::string& command) {
  std::string output;
  FILE* const pipe = ::popen((command + " 2>&1 < /dev/null").c_str(), "r");
  if (!pipe) return output;
  char buffer[4096];
  while (const std::size_t got = std::fread(buffer, 1, sizeof buffer, pipe)) output.append(buffer, got);
  ::pclose(pipe);
  return output;
}

/// Processes by the one that started them.
inline std::multimap<pid_t, pid_t> list_children() {
  std::multimap<pid_t, pid_t> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const pid_t pid = std::atoi(entry.path().filename().c_str());
    if (pid <= 0) continue;
    const std::string stat = read_file(entry.path() / "stat");
    const std::size_t name_end = stat.rfind(')');  // "1 (name) S 0 ..."
    if (name_end != std::string::npos) children.emplace(std::atoi(stat.c_str() + name_end + 4), pid);
  }
  return children;
}

/// Everything that runs here is a descendant of this process, daemons too, and ends with it.
class SlurmCluster {
 public:
  static bool installed() {
    for (const char* const program : {"munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel"})
      if (std::system((std::string("PATH=$PATH:/usr/sbin command -v ") + program + " > /dev/null").c_str()) !=
          0)
        return false;
    return true;
  }

  SlurmCluster() {
    ::prctl(PR_SET_CHILD_SUBREAPER, 1);
    const char* const path = std::getenv("PATH");
    ::setenv("PATH", (std::string(path ? path : "/bin") + ":/usr/sbin").c_str(), 1);
    ::setenv("SLURM_CONF", folder_.file("slurm.conf").c_str(), 1);
    for (const char* const name : {"state", "spool-n1", "spool-n2"})
      std::filesystem::create_directory(folder_.file(name));
    std::random_device random;
    std::string key(128, '\0');
    for (char& c : key) c = static_cast<char>(random());
    std::filesystem::permissions(folder_.write("munge.key", key), std::filesystem::perms::owner_read);
    start({"munged", "--foreground", "--force", "--num-threads=2", "--key-file=" + folder_.file("munge.key"),
           "--socket=" + folder_.file("munge.socket"), "--pid-file=" + folder_.file("munged.pid"),
           "--log-file=" + folder_.file("munged.log"), "--seed-file=" + folder_.file("munged.seed")});
    wait_until([&] { return std::filesystem::exists(folder_.file("munge.socket")); }, 10);
    // A port that was free may be taken a moment later.
    for (int attempt = 0; attempt < 3 && !up_; ++attempt) {
      stop_nodes();
      write_configuration();
      controller_ = start({"slurmctld", "-D", "-i"});
      for (const char* const node : kNodes) nodes_[node] = start({"slurmd", "-D", "-N", node});
      up_ = wait_until([] { return read_command("sinfo -h -t idle -o %D") == "2\n"; }, 15);
    }
  }
  ~SlurmCluster() {
    for (;;) {
      std::set<pid_t> living;
      const auto children = list_children();
      add_descendants(children, ::getpid(), living);
      if (living.empty()) break;
      for (const pid_t pid : living) ::kill(pid, SIGKILL);
      while (::waitpid(-1, nullptr, WNOHANG) > 0) {
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ::prctl(PR_SET_CHILD_SUBREAPER, 0);
  }
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  bool up() const { return up_; }
  std::string log() const { return read_command("tail -n 20 '" + folder_.path().string() + "'/*.log"); }

  /// Processes of jobs on a node, those that Slurm started.
  std::vector<pid_t> job_processes(const std::string& node) const {
    std::set<pid_t> own;
    add_descendants(list_children(), ::getpid(), own);
    std::vector<pid_t> found;
    for (const pid_t pid : own)
      if (read_file("/proc/" + std::to_string(pid) + "/environ").find("SLURMD_NODENAME=" + node) !=
          std::string::npos)
        found.push_back(pid);
    return found;
  }
  /// As if its power failed: nothing on it says a word more.
  void kill_node(const std::string& node) {
    ::kill(nodes_[node], SIGKILL);
    const auto children = list_children();
    for (const pid_t pid : job_processes(node)) {
      for (const auto& [parent, child] : children)
        if (child == pid && parent != ::getpid()) ::kill(parent, SIGKILL);  // slurmstepd
      ::kill(pid, SIGKILL);
    }
  }

 private:
  static constexpr const char* kNodes[] = {"n1", "n2"};

  static void add_descendants(const std::multimap<pid_t, pid_t>& children, pid_t parent,
                              std::set<pid_t>& found) {
    const auto [begin, end] = children.equal_range(parent);
    for (auto child = begin; child != end; ++child)
      if (found.insert(child->second).second) add_descendants(children, child->second, found);
  }

  // Ends with this process, whatever ends it.
  pid_t start(const std::vector<std::string>& words) {
    std::vector<char*> argv;
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    const std::string log = folder_.file(words[0] + ".out.log");
    const pid_t pid = ::fork();
    if (pid != 0) return pid;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::setsid();
    const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    ::dup2(out, STDOUT_FILENO);
    ::dup2(out, STDERR_FILENO);
    ::execvp(argv[0], argv.data());
    ::_exit(127);
  }

  void stop_nodes() {
    for (const auto& [node, pid] : nodes_) ::kill(pid, SIGKILL);
    if (controller_ > 0) ::kill(controller_, SIGKILL);
    nodes_.clear();
  }

  // Free ones: all are open until all are known.
  static std::vector<int> find_ports(int count) {
    std::vector<int> ports, sockets;
    for (int i = 0; i < count; ++i) {
      const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      socklen_t size = sizeof address;
      ::bind(descriptor, reinterpret_cast<sockaddr*>(&address), size);
      ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size);
      ports.push_back(ntohs(address.sin_port));
      sockets.push_back(descriptor);
    }
    for (const int descriptor : sockets) ::close(descriptor);
    return ports;
  }

  void write_configuration() {
    char host[256] = "";
    ::gethostname(host, sizeof host - 1);
    std::string name = host;
    name = name.substr(0, name.find('.'));
    std::string user = read_command("id -un");
    user.pop_back();
    const std::string folder = folder_.path().string();
    const std::vector<int> ports = find_ports(3);
    std::ostringstream text;
    text << "ClusterName=nacre\nSlurmctldHost=" << name << "(127.0.0.1)\nSlurmctldPort=" << ports[0]
         << "\nAuthType=auth/munge\nAuthInfo=socket=" << folder
         << "/munge.socket,cred_expire=5\nSlurmUser=" << user << "\nSlurmdUser=" << user
         << "\nStateSaveLocation=" << folder << "/state\nSlurmdSpoolDir=" << folder
         << "/spool-%n\nSlurmctldPidFile=" << folder << "/slurmctld.pid\nSlurmdPidFile=" << folder
         << "/slurmd-%n.pid\nSlurmctldLogFile=" << folder << "/slurmctld.log\nSlurmdLogFile=" << folder
         << "/slurmd-%n.log\n"
            "ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\n"
            "AccountingStorageType=accounting_storage/none\nSwitchType=switch/none\nMpiDefault=none\n"
            "SelectType=select/cons_tres\nSelectTypeParameters=CR_Core\nSlurmdParameters=config_overrides\n"
            "SchedulerParameters=sched_interval=1,batch_sched_delay=0\nSlurmdTimeout=3\nMessageTimeout="
            "2\nReturnToService=2\n";
    for (std::size_t i = 0; i < std::size(kNodes); ++i)
      text << "NodeName=" << kNodes[i] << " NodeHostname=" << name
           << " NodeAddr=127.0.0.1 Port=" << ports[i + 1] << " CPUs=1\n";
    text << "PartitionName=all Nodes=ALL Default=YES State=UP\n";
    folder_.write("slurm.conf", text.str());
  }

  TemporaryFolder folder_;
  std::map<std::string, pid_t> nodes_;
  pid_t controller_ = 0;
  bool up_ = false;
};

}  // namespace nacre::testing_support
