//! User identity tokens by which servers learn who reads (OPC 10000-4, 7.40).

use async_opcua::crypto::{SecurityPolicy, create_signature_data, legacy_encrypt_secret};
use async_opcua::types::{
    AnonymousIdentityToken, ByteString, EndpointDescription, ExtensionObject, MessageSecurityMode,
    SignatureData, UAString, UserNameIdentityToken, UserTokenPolicy, UserTokenType,
    X509IdentityToken,
};

use crate::fault::Fault;
use crate::security::{Own, Protection, leaf};
use crate::settings::User;

/// Creates the token of a user and its signature, for a session on this endpoint with this server
/// nonce.
pub(crate) fn token(
    user: &User,
    endpoint: &EndpointDescription,
    protection: Protection,
    nonce: &ByteString,
) -> Result<(ExtensionObject, SignatureData), Fault> {
    match user {
        User::Anonymous => {
            let policy = policy_of(endpoint, UserTokenType::Anonymous, "an anonymous user")?;
            let token = AnonymousIdentityToken { policy_id: policy.policy_id.clone() };
            Ok((ExtensionObject::from_message(token), SignatureData::null()))
        }
        User::Password { name, password, allow_plain } => {
            let policy = policy_of(endpoint, UserTokenType::UserName, "a name and a password")?;
            let is_plain = protection.mode != MessageSecurityMode::SignAndEncrypt
                && effective(policy, protection) == SecurityPolicy::None;
            if is_plain && !allow_plain {
                return Err(Fault::User(
                    "the server would get the password unencrypted: use the setting security, or \
                     set user.allow_plain_password where the network is trusted"
                        .into(),
                ));
            }
            let certificate = leaf(&endpoint.server_certificate).ok();
            if !is_plain && certificate.is_none() {
                return Err(Fault::User("the server has no certificate to encrypt for".into()));
            }
            let password =
                password.read().map_err(|error| Fault::User(error.message().to_owned()))?;
            let secret = legacy_encrypt_secret(
                protection.policy,
                protection.mode,
                policy,
                nonce.as_ref(),
                &certificate,
                password.reveal().as_bytes(),
            )
            .map_err(|error| Fault::User(error.to_string()))?;
            let token = UserNameIdentityToken {
                policy_id: secret.policy,
                user_name: UAString::from(name.as_str()),
                password: secret.secret,
                encryption_algorithm: secret.encryption_algorithm,
            };
            Ok((ExtensionObject::from_message(token), SignatureData::null()))
        }
        User::Certificate { certificate, key } => {
            let policy = policy_of(endpoint, UserTokenType::Certificate, "a user's certificate")?;
            let own = Own::load(certificate, key).map_err(Fault::User)?;
            let server = leaf(&endpoint.server_certificate).map_err(Fault::User)?;
            let signature = create_signature_data(
                &own.key,
                effective(policy, protection),
                &server.as_byte_string(),
                nonce,
            )
            .map_err(|error| Fault::User(error.to_string()))?;
            let token = X509IdentityToken {
                policy_id: policy.policy_id.clone(),
                certificate_data: own.certificate.as_byte_string(),
            };
            Ok((ExtensionObject::from_message(token), signature))
        }
    }
}

/// Returns the security policy that protects a token: its own, or that of the channel.
fn effective(policy: &UserTokenPolicy, protection: Protection) -> SecurityPolicy {
    if policy.security_policy_uri.is_empty() {
        protection.policy
    } else {
        SecurityPolicy::from_uri(policy.security_policy_uri.as_ref())
    }
}

/// Returns the endpoint's token policy for a type of user.
fn policy_of<'a>(
    endpoint: &'a EndpointDescription,
    wanted: UserTokenType,
    whom: &str,
) -> Result<&'a UserTokenPolicy, Fault> {
    let is_known = |policy: &UserTokenPolicy| {
        let uri = &policy.security_policy_uri;
        uri.is_empty() || SecurityPolicy::from_uri(uri.as_ref()) != SecurityPolicy::Unknown
    };
    let policies = endpoint.user_identity_tokens.iter().flatten();
    let mut policies = policies.filter(|policy| policy.token_type == wanted && is_known(policy));
    policies.next().ok_or_else(|| {
        Fault::User(format!(
            "this endpoint of the server does not take {whom}: correct the setting user"
        ))
    })
}
