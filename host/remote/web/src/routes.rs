//! HTTP routes: the page, its parts, its WebSocket.

use std::sync::Arc;

use axum::Router;
use axum::body::Body;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{FromRequestParts, Request, State};
use axum::http::header::{CONNECTION, CONTENT_TYPE, HeaderValue};
use axum::http::{Method, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tokio::sync::{Semaphore, watch};

use crate::access::{Access, PROTOCOL};
use crate::hub::Hub;
use crate::message::MAX_MESSAGE_BYTES;
use crate::session;

/// Placeholder in the page for the origins that may speak to it.
const ORIGINS_PLACE: &str = "{{origins}}";
const PAGE: &str = include_str!("page/index.html");
/// Files of the page: nothing in there is a secret.
const PARTS: [(&str, &str, &str); 8] = [
    ("/view.css", "text/css", include_str!("page/view.css")),
    ("/view.js", "text/javascript", include_str!("page/view.js")),
    ("/liveness.js", "text/javascript", include_str!("page/liveness.js")),
    ("/picture_age.js", "text/javascript", include_str!("page/picture_age.js")),
    ("/connection.js", "text/javascript", include_str!("page/connection.js")),
    ("/picture.js", "text/javascript", include_str!("page/picture.js")),
    ("/input.js", "text/javascript", include_str!("page/input.js")),
    ("/host_page.js", "text/javascript", include_str!("page/host_page.js")),
];

/// State shared by all requests.
pub(crate) struct RouteState {
    pub(crate) access: Access,
    pub(crate) hub: Arc<Hub>,
    pub(crate) places: Arc<Semaphore>,
    pub(crate) max_clients: usize,
    pub(crate) stopping: watch::Receiver<bool>,
}

/// Creates the router of all paths.
pub(crate) fn router(state: Arc<RouteState>) -> Router {
    let mut router = Router::new().route("/", get(page)).route("/socket", get(socket));
    for (path, kind, text) in PARTS {
        let part = move || async move { ([(CONTENT_TYPE, HeaderValue::from_static(kind))], text) };
        router = router.route(path, get(part));
    }
    router.layer(from_fn_with_state(state.clone(), guard)).with_state(state)
}

/// Refuses requests for another server and other methods than GET, and protects the answer by
/// headers.
async fn guard(State(state): State<Arc<RouteState>>, request: Request, next: Next) -> Response {
    let mut response = if !state.access.is_host_known(request.headers()) {
        let why = "this name is none of this server's: ask by its address, or let `busbar serve` \
                   know the name with --allow-origin";
        refusal(StatusCode::FORBIDDEN, why)
    } else if *request.method() != Method::GET {
        refusal(StatusCode::METHOD_NOT_ALLOWED, "only GET is answered here")
    } else {
        next.run(request).await
    };
    state.access.protect(response.headers_mut());
    if response.status() != StatusCode::SWITCHING_PROTOCOLS {
        // A connection that asked has its answer; others wait for its place.
        response.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
    }
    response
}

async fn page(State(state): State<Arc<RouteState>>, request: Request) -> Response {
    if !state.access.has_token(request.uri().query(), request.headers()) {
        return no_token();
    }
    let html = PAGE.replace(ORIGINS_PLACE, &state.access.allowed());
    let mut response = axum::response::Html(html).into_response();
    state.access.keep_token(response.headers_mut());
    response
}

async fn socket(State(state): State<Arc<RouteState>>, request: Request) -> Response {
    let (mut parts, _) = request.into_parts();
    if !state.access.has_token(parts.uri.query(), &parts.headers) {
        return no_token();
    }
    let upgrade = match WebSocketUpgrade::from_request_parts(&mut parts, &()).await {
        Ok(upgrade) => upgrade,
        // A page whose socket is refused asks so whether its token is.
        Err(_) => return refusal(StatusCode::UPGRADE_REQUIRED, "this is a WebSocket"),
    };
    if !state.access.is_origin_known(&parts.headers) {
        let why = "pages of this origin may not look: start `busbar serve` with --allow-origin";
        return refusal(StatusCode::FORBIDDEN, why);
    }
    let upgrade = upgrade
        .protocols([PROTOCOL])
        .max_message_size(MAX_MESSAGE_BYTES)
        .max_frame_size(MAX_MESSAGE_BYTES);
    if upgrade.selected_protocol().is_none() {
        return refusal(StatusCode::BAD_REQUEST, "the page is of another release; load it anew");
    }
    let (hub, stopping, places) = (state.hub.clone(), state.stopping.clone(), state.max_clients);
    match state.places.clone().try_acquire_owned() {
        Ok(place) => upgrade.on_upgrade(move |socket| async move {
            session::run(socket, hub, stopping).await;
            drop(place);
        }),
        Err(_) => upgrade.on_upgrade(move |socket| session::refuse(socket, places)),
    }
}

fn no_token() -> Response {
    let why = "this view is shown to whoever has its token alone: open the address that \
               `busbar serve` printed, with ?token= at its end";
    refusal(StatusCode::UNAUTHORIZED, why)
}

/// Creates a plain-text error page.
fn refusal(status: StatusCode, why: &str) -> Response {
    let words = format!("{status}: {why}\n");
    let kind = HeaderValue::from_static("text/plain; charset=utf-8");
    (status, [(CONTENT_TYPE, kind)], Body::from(words)).into_response()
}
