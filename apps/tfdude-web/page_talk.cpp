#include "page_talk.hpp"

#include <chrono>
#include <utility>

#include "tfdude/types/version.hpp"

#include "../rendering/json.hpp"
#include "page_recording.hpp"
#include "request.hpp"

namespace tfdude::web {
namespace {

// A page that has so much to take yet gets no picture.
constexpr std::size_t kPageBehind = std::size_t{256} << 10U;  // [B]
// Covariances change slowly and are large: every so many pictures.
constexpr int kCovarianceEvery = 15;
// A page may change its pair so often; of wishes in between, the last one counts. Each pair is
// watched at its owners.
constexpr std::chrono::milliseconds kPairEvery{200};

class PageTalk final : public Talk {
 public:
  PageTalk(Live& live, Recordings& recordings, Post post)
      : live_(live), post_(std::move(post)), recording_(recordings) {
    live_.count_viewer(1);
  }
  ~PageTalk() override { live_.count_viewer(-1); }
  PageTalk(const PageTalk&) = delete;
  PageTalk& operator=(const PageTalk&) = delete;

  void begin(Link& link) override {
    link_ = &link;
    recording_.begin(link);
    const nlohmann::json hello{{"op", "hello"}, {"version", version_line()}};
    send(std::make_shared<const std::string>(cli::dump(hello)));
    send(live_.status());
    status_ = live_.status_change().first;
    tick();
  }

  bool receive(std::string_view message, bool binary) override {
    if (binary) return recording_.take(message);
    const auto request = parse_request(message);
    if (!request) return false;
    if (const auto* upload = std::get_if<UploadRequest>(&*request)) return recording_.take(*upload);
    if (std::holds_alternative<CancelRequest>(*request)) {
      recording_.cancel();
    } else if (std::holds_alternative<RobotRequest>(*request)) {
      recording_.leave();
      asked_for_robot_ = true;
    } else if (const auto* pair = std::get_if<PairRequest>(&*request)) {
      ends_ = *pair;
      if (recording_.is_shown()) {
        recording_.follow(*pair);
      } else {
        wish_ = *pair;
        take_wish();
      }
    } else if (recording_.is_shown()) {
      // There is no newest value to go to, and nobody to explain.
      if (const auto* past = std::get_if<PastRequest>(&*request)) recording_.show(past->at);
    } else if (const auto* past = std::get_if<PastRequest>(&*request)) {
      past_ = past->at;
      past_due_ = true;  // with the next picture, however many of these come until then
      ask();
    } else if (std::holds_alternative<WhyRequest>(*request)) {
      explain();
    } else {
      past_.reset();
      past_due_ = false;
      values_ = 0;
      covariances_ = 0;
      pair_number_ = 0;
    }
    return true;
  }

  void tick() override {
    const bool behind = link_->waiting() > kPageBehind;
    recording_.tick(behind);
    const bool asked = std::exchange(asked_for_robot_, false);
    if (recording_.is_shown() != recorded_ || asked) change_over();
    if (recorded_) return;
    take_wish();
    if (behind) return;
    send_structure();
    send_events();
    send_status();
    if (past_due_) send_past();
    if (past_) return;
    if (pair_ && pair_->number() != pair_number_) {
      pair_number_ = pair_->number();
      send(pair_->answer());
    }
    if (const Text values = live_.values_since(values_)) link_->send(values, true);
    values_ = live_.picture();
    if (covariances_ != 0 && live_.picture() < covariances_ + kCovarianceEvery) return;
    if (const Text covariances = live_.covariances_since(covariances_)) {
      link_->send(covariances, true);
    }
    covariances_ = live_.picture();
  }

 private:
  // Between the robot and a recording. What owners were asked for is not wanted any more.
  void change_over() {
    recorded_ = recording_.is_shown();
    pair_ = nullptr;
    past_.reset();
    past_due_ = false;
    wish_.reset();
    if (recorded_) return recording_.follow(ends_);
    send(std::make_shared<const std::string>(cli::dump({{"op", "robot"}})));
    send(live_.status());
    status_ = live_.status_change().first;
    structure_ = 0;  // it is sent again, with all values
    events_ = 0;
    joints_ = 0;
    wish_ = ends_;
  }

  void take_wish() {
    const auto now = std::chrono::steady_clock::now();
    if (!wish_ || now < next_pair_) return;
    next_pair_ = now + kPairEvery;
    const PairRequest wish = *std::exchange(wish_, {});
    pair_ = wish.a.empty() ? nullptr : live_.pairs().follow(wish.a, wish.b);
    pair_number_ = 0;
    if (past_) ask();
  }

  void send(const Text& text) {
    if (text) link_->send(text, false);
  }

  void send_structure() {
    const Text structure = live_.structure();
    if (live_.structure_number() == structure_) return;
    structure_ = live_.structure_number();
    send(structure);
    values_ = 0;
    covariances_ = 0;
    past_due_ = past_.has_value();
  }

  void send_past() {
    past_due_ = false;
    for (std::string& part : live_.world().at(*past_)) {
      link_->send(std::make_shared<const std::string>(std::move(part)), true);
    }
  }

  void send_status() {
    const auto [number, change] = live_.status_change();
    // A page that has missed a change needs all.
    if (number != status_) send(number == status_ + 1 ? change : live_.status());
    status_ = number;
    const auto [joints_number, joints] = live_.joints();
    if (joints_number != joints_) send(joints);
    joints_ = joints_number;
  }

  void send_events() {
    const auto events = live_.events_after(events_);
    if (events.empty()) return;
    nlohmann::json list = nlohmann::json::array();
    for (const Event& event : events) list.push_back(event.json);
    events_ = events.back().number;
    send(std::make_shared<const std::string>(
        cli::dump({{"op", "events"}, {"events", std::move(list)}})));
  }

  // Asks the owners for the pair at the instant that is shown. The page may leave before they
  // answer, so the worker does not touch this object. While they answer, only the last
  // wish is kept.
  void ask() {
    if (!pair_ || !past_ || *asking_) return;
    *asking_ = true;
    const bool posted = live_.worker().post([this, &live = live_, pair = pair_, past = *past_,
                                             alive = std::weak_ptr<bool>(asking_), post = post_] {
      const Text answer = live.pairs().answer_at(pair->a(), pair->b(), past);
      post([this, pair, past, alive, answer] {
        const auto asking = alive.lock();
        if (!asking) return;
        *asking = false;
        if (past_ == past && pair_ == pair) {
          send(answer);
        } else {
          ask();
        }
      });
    });
    if (!posted) *asking_ = false;
  }

  // Asks the owners why the pair is as it is, unless they are asked already.
  void explain() {
    if (!pair_ || *explaining_) return;
    *explaining_ = true;
    const bool posted =
        live_.worker().post([this, &live = live_, pair = pair_, past = past_,
                             alive = std::weak_ptr<bool>(explaining_), post = post_] {
          const Text text = live.pairs().explained(pair->a(), pair->b(), past);
          post([this, pair, alive, text] {
            const auto explaining = alive.lock();
            if (!explaining) return;
            *explaining = false;
            if (pair_ == pair) send(text);
          });
        });
    if (!posted) *explaining_ = false;
  }

  Live& live_;
  Post post_;
  Link* link_ = nullptr;
  std::uint32_t structure_ = 0;
  std::uint64_t values_ = 0;
  std::uint64_t covariances_ = 0;
  std::uint64_t events_ = 0;
  std::uint64_t status_ = 0;
  std::uint64_t joints_ = 0;
  PageRecording recording_;
  bool asked_for_robot_ = false;
  bool recorded_ = false;  // the page was told of a recording last
  PairRequest ends_;       // that the page has chosen
  std::optional<PairRequest> wish_;
  std::chrono::steady_clock::time_point next_pair_;  // when it may change
  std::shared_ptr<Pair> pair_;
  std::uint64_t pair_number_ = 0;
  std::optional<Time> past_;
  bool past_due_ = false;  // its picture was not sent yet
  // Also says whether this object exists, to answers that come later.
  std::shared_ptr<bool> asking_ = std::make_shared<bool>(false);
  std::shared_ptr<bool> explaining_ = std::make_shared<bool>(false);
};

}  // namespace

std::unique_ptr<Talk> talk_to_page(Live& live, Recordings& recordings, Post post) {
  return std::make_unique<PageTalk>(live, recordings, std::move(post));
}

}  // namespace tfdude::web
